// Messages of topics as they come, for one Python thread at a time. It waits without the GIL and
// hears Ctrl-C within 50 ms.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/wait_loop.h"
#include "tools/python/bus.h"

namespace perdure::python {

class Subscription {
 public:
  /// `gone`: also what is disposed of. Raises UnknownTopic.
  Subscription(std::shared_ptr<Bus> bus, std::vector<std::string> topics, bool gone);
  ~Subscription();

  /// (topic, message, whether it is gone), in the order of arrival; None after the time (nothing:
  /// never), or once it is closed.
  pybind11::object next(std::optional<double> seconds);
  /// From any thread; who waits goes on.
  void close();
  bool closed() const { return loop_.stopped(); }
  /// Writers that are matched now, of all its topics.
  std::size_t matched() const;
  /// What DDS and the checks have counted: <topic>_malformed_<reason>, _sample_lost, …
  ReasonCounts counts() const;
  /// The first thing that was malformed: the field and the reason; empty where there was none.
  std::string firstProblem() const;
  std::string whySilent() const;

 private:
  void add(const std::string& topic, bool gone);
  template <class T>
  void keep(const std::string& topic, const T& message, bool gone);
  /// False once the time is over.
  bool wait(std::optional<std::chrono::steady_clock::time_point> end);

  const std::shared_ptr<Bus> bus_;
  const std::vector<std::string> topics_;
  std::vector<std::shared_ptr<bus::RawReader>> readers_;
  bus::WaitLoop loop_;
  std::deque<pybind11::object> ready_;
  std::exception_ptr failure_;
  std::atomic<bool> waits_{false};
};

void bindSubscription(pybind11::module_& module);

}  // namespace perdure::python

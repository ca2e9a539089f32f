// Messages of topics in the order of arrival, for one Python thread at a time. It waits without the
// GIL and checks for Ctrl-C every 50 ms.
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
  /// `gone`: also returns disposed instances. Raises UnknownTopic.
  Subscription(std::shared_ptr<Bus> bus, std::vector<std::string> topics, bool gone);
  ~Subscription();

  /// (topic, message, whether it was disposed), in the order of arrival; None after the time
  /// (without a value: no limit) or after close().
  pybind11::object next(std::optional<double> seconds);
  /// Ends a wait; may be called from any thread.
  void close();
  bool closed() const { return loop_.stopped(); }
  /// Number of matched writers of all its topics.
  std::size_t matched() const;
  /// Counts of DDS and of the checks: <topic>_malformed_<reason>, _sample_lost, …
  ReasonCounts counts() const;
  /// The first malformed message: the field and the reason; empty if there was none.
  std::string firstProblem() const;
  std::string whySilent() const;

 private:
  void add(const std::string& topic, bool gone);
  template <class T>
  void keep(const std::string& topic, const T& message, bool gone);
  /// Returns false when the time is over.
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

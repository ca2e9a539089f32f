#include <pybind11/stl.h>

#include <atomic>
#include <deque>

#include "common/bus/wait_loop.h"
#include "tools/python/bindings.h"
#include "tools/python/bus.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/raise.h"

namespace perdure::python {
namespace {

namespace py = pybind11;
using Clock = std::chrono::steady_clock;

std::optional<Clock::time_point> endAfter(std::optional<double> seconds) {
  if (!seconds) return std::nullopt;
  constexpr double kLongest = 1e8;  // three years, which the clock can represent
  const std::chrono::duration<double> length(std::clamp(*seconds, 0.0, kLongest));
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(length);
}

/// Messages in the order of arrival, for one Python thread. Releases the GIL while it waits.
class Subscription {
 public:
  /// `gone`: also returns disposed instances. Raises UnknownTopic if a topic does not exist.
  Subscription(std::shared_ptr<Bus> bus, std::vector<std::string> topics, bool gone)
      : bus_(std::move(bus)), topics_(std::move(topics)), loop_(bus_->participant()) {
    for (const std::string& topic : topics_) add(topic, gone);
  }
  ~Subscription() {
    for (const auto& reader : readers_) loop_.off(*reader);
  }

  /// Returns (topic, message, disposed). Returns None after `seconds` (empty: no limit) or close().
  py::object next(std::optional<double> seconds) {
    if (waits_.exchange(true)) {
      raise(
          "Error",
          "another thread waits for this subscription; make one for each thread, or put what comes "
          "into a queue.Queue");
    }
    struct Done {
      std::atomic<bool>& waits;
      ~Done() { waits = false; }
    } const done{waits_};
    const auto end = endAfter(seconds);
    bool time_left = true;
    while (ready_.empty() && time_left && !loop_.stopped()) {
      time_left = wait(end);
      if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    if (ready_.empty() || loop_.stopped()) return py::none();
    py::object first = std::move(ready_.front());
    ready_.pop_front();
    return first;
  }
  /// Ends a wait; may be called from any thread.
  void close() { loop_.stop(); }
  bool closed() const { return loop_.stopped(); }
  /// Number of matched writers of all subscribed topics.
  std::size_t matched() const {
    std::size_t n = 0;
    for (const auto& reader : readers_) n += reader->matched();
    return n;
  }
  /// Counts of DDS and of the message checks: <topic>_malformed_<reason>, _sample_lost, …
  ReasonCounts counts() const {
    ReasonCounts counts;
    for (const auto& reader : readers_) reader->report(counts);
    return counts;
  }
  std::string whySilent() const {
    if (const std::string problem = firstProblem(); !problem.empty()) {
      return "what came could not be read: " + problem;
    }
    std::string sentences;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      sentences += (i > 0 ? ". " : "") + bus_->whySilent(topics_[i], readers_[i]->matched());
    }
    return sentences;
  }

 private:
  void add(const std::string& topic, bool gone) {
    const auto make = [&]<class T>(const bus::Topic<T>& typed) {
      auto reader = std::make_shared<bus::Reader<T>>(bus_->participant(), typed);
      const auto take = [this, topic](const T& message) { keep(topic, message, false); };
      const auto leave = [this, topic](const T& key) { keep(topic, key, true); };
      loop_.on<T>(*reader, take, gone ? typename bus::Reader<T>::Handler(leave) : nullptr);
      readers_.push_back(std::move(reader));
    };
    if (!bus::withTopic(topic, make)) refuseTopic(topic);
  }
  template <class T>
  void keep(const std::string& topic, const T& message, bool gone) {
    const py::gil_scoped_acquire gil;
    if (failure_) return;
    try {
      ready_.push_back(py::make_tuple(topic, toPython(message), gone));
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  /// Waits for a message. Returns false if the time is over.
  bool wait(std::optional<Clock::time_point> end) {
    constexpr std::chrono::nanoseconds kSlice = std::chrono::milliseconds(50);
    std::chrono::nanoseconds longest = kSlice;
    if (end) longest = std::clamp<std::chrono::nanoseconds>(*end - Clock::now(), {}, kSlice);
    const py::gil_scoped_release waits;
    loop_.runOnce(longest);
    return !end || Clock::now() < *end;
  }
  /// Field and reason of the first malformed message; empty if there was none.
  std::string firstProblem() const {
    for (const auto& reader : readers_) {
      for (const auto& [count, detail] : reader->firstDetails()) return count + ": " + detail;
    }
    return {};
  }

  const std::shared_ptr<Bus> bus_;
  const std::vector<std::string> topics_;
  std::vector<std::shared_ptr<bus::RawReader>> readers_;
  bus::WaitLoop loop_;
  std::deque<pybind11::object> ready_;
  std::exception_ptr failure_;
  std::atomic<bool> waits_{false};
};

}  // namespace

void bindSubscription(py::module_& module) {
  py::class_<Subscription>(module, "Subscription")
      .def(py::init<std::shared_ptr<Bus>, std::vector<std::string>, bool>(), py::arg("bus"),
           py::arg("topics"), py::arg("gone"))
      .def("next", &Subscription::next, py::arg("seconds"))
      .def("close", &Subscription::close, "Ends the subscription; a waiting ``next`` returns None.")
      .def_property_readonly("closed", &Subscription::closed)
      .def_property_readonly("matched", &Subscription::matched, "The current number of writers.")
      .def_property_readonly(
          "counts", [](const Subscription& self) { return self.counts().all(); },
          "Lost or unreadable messages since the start, by reason (as in Health):\n"
          "\"objects_malformed_bad_covariance\", \"frame_cam0_sample_lost\", …")
      .def("why_silent", &Subscription::whySilent, py::call_guard<py::gil_scoped_release>());
}

}  // namespace perdure::python

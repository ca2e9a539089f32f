#include <pybind11/stl.h>

#include <set>

#include "common/bus/topics.h"
#include "common/replay/recordings/recorded_messages.h"
#include "tools/python/bindings.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/raise.h"

namespace perdure::python {
namespace {

namespace py = pybind11;

class Recording {
 public:
  /// `topics`: if empty, all. Raises UnknownTopic for an unknown one. Throws StartupError if the
  /// file cannot be read.
  Recording(const std::string& path, const std::vector<std::string>& topics)
      : messages_(path), wanted_(topics.begin(), topics.end()) {
    for (const std::string& topic : topics) {
      if (!messages_.topics().contains(topic)) refuseTopic(path, topic);
    }
    rewind();
  }

  void rewind() {
    messages_.rewind([this](const std::string& topic) {
      return wanted_.empty() ? bus::findTopic(topic) != nullptr : wanted_.contains(topic);
    });
  }

  /// Returns (topic, ns of the recorder's clock, message); None at the end. Counts unreadable
  /// messages.
  py::object next() {
    for (;;) {
      py::object read = py::none();
      std::optional<replay::RecordedMessage> message;
      {
        const py::gil_scoped_release unpacks;
        message = messages_.next();
      }
      if (!message) return py::none();
      bus::withTopic(message->topic, [&]<class T>(const bus::Topic<T>&) {
        const Result<T> value = replay::valueOf<T>(*message);
        if (value) {
          read = py::make_tuple(message->topic, message->log_ns, toPython(*value));
        } else {
          count(*message, value.error());
        }
      });
      if (!read.is_none()) return read;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }

  py::dict topics() const {
    py::dict found;
    for (const auto& [name, topic] : messages_.topics()) found[name.c_str()] = topic.messages;
    return found;
  }
  std::uint64_t startNs() const { return messages_.startNs(); }
  std::uint64_t endNs() const { return messages_.endNs(); }
  std::map<std::string, std::uint64_t> counts() const {
    auto all = counts_.all();
    for (const auto& [reason, n] : messages_.reasons().all()) all[reason] += n;
    return all;
  }
  /// Describes the last problem; empty if no message was omitted.
  std::string problem() const { return problem_.empty() ? messages_.lastProblem() : problem_; }
  bool otherVersion() const { return other_version_; }

 private:
  void refuseTopic(const std::string& path, const std::string& topic) const {
    std::string names;
    for (const auto& [name, ignored] : messages_.topics()) {
      names += (names.empty() ? "" : ", ") + name;
    }
    raise("UnknownTopic", path + " holds no " + topic + "; it holds " + names);
  }
  void count(const replay::RecordedMessage& message, const Reason& reason) {
    counts_.add(message.topic + "_" + reason.code);
    other_version_ = other_version_ || reason.code == "other_type" ||
                     reason.code == "malformed_cdr" || reason.code == "bad_encapsulation";
    if (problem_.empty()) problem_ = message.topic + ": " + reason.code + ", " + reason.detail;
  }

  replay::RecordedMessages messages_;
  const std::set<std::string> wanted_;
  ReasonCounts counts_;
  std::string problem_;
  bool other_version_ = false;
};

}  // namespace

void bindRecording(py::module_& module) {
  py::class_<Recording>(module, "Recording")
      .def(py::init<const std::string&, const std::vector<std::string>&>(), py::arg("path"),
           py::arg("topics"))
      .def("next", &Recording::next)
      .def("rewind", &Recording::rewind)
      .def_property_readonly("topics", &Recording::topics)
      .def_property_readonly("start_ns", &Recording::startNs)
      .def_property_readonly("end_ns", &Recording::endNs)
      .def_property_readonly("counts", &Recording::counts)
      .def_property_readonly("problem", &Recording::problem)
      .def_property_readonly("other_version", &Recording::otherVersion);
}

}  // namespace perdure::python

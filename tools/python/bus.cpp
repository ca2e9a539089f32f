#include "tools/python/bus.h"

#include <pybind11/stl.h>

#include <map>
#include <mutex>

#include "common/bus/discovery.h"
#include "tools/bus_tools/settings.h"
#include "tools/python/bindings.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/raise.h"

namespace perdure::python {

namespace py = pybind11;

namespace {

bus::Options applied(const BusSettings& settings, bus::Options options) {
  if (settings.interface) options.interface = *settings.interface;
  if (settings.vehicle) options.vehicle = *settings.vehicle;
  if (settings.security) options.security = *settings.security;
  if (settings.identity) options.identity = *settings.identity;
  if (settings.peers) options.peers = *settings.peers;
  if (settings.domain) options.domain = *settings.domain;
  return bus::withEnvironment(options);
}

/// Throws StartupError if the open domain has other options than those requested.
void requireSame(const bus::Options& open, const bus::Options& wanted) {
  if (wanted.interface != open.interface || wanted.peers != open.peers) {
    throw StartupError(ExitCode::kUsage,
                       "this process is on domain " + std::to_string(open.domain) +
                           " by interface " + open.interface +
                           " already, and DDS opens a domain once a process; use the same "
                           "interface and peers, or another process");
  }
  const bool same = wanted.security == open.security && wanted.identity == open.identity;
  if (!same && !(wanted.security.empty() && open.security.empty())) {
    throw StartupError(ExitCode::kUsage, "this process is the identity " + open.identity +
                                             " of \"" + open.security +
                                             "\" already, and is one alone; give identity=\"" +
                                             open.identity + "\" here too, or use another process");
  }
}

/// Options of a subscriber: no shared memory, and by default the identity "subscriber".
bus::Options optionsOf(const BusSettings& settings) {
  bus::Options options = applied(settings, tools::listenersOptions());
  if (options.identity.empty()) options.identity = "subscriber";
  return options;
}

}  // namespace

bus::Options serviceOptionsOf(const BusSettings& settings, const std::string& process) {
  bus::Options options = applied(settings, tools::servicesOptions());
  if (options.identity.empty()) options.identity = bus::identityOf(process);
  return options;
}

bus::Domain openDomain(const bus::Options& options) {
  static std::mutex mutex;
  static auto& open = *new std::map<std::int64_t, bus::Domain*>;  // the map is never deleted
  const std::lock_guard lock(mutex);
  const auto at = open.find(options.domain);
  if (at == open.end()) {
    auto* domain = new bus::Domain(options);
    open.emplace(options.domain, domain);
    return *domain;
  }
  requireSame(at->second->options(), options);
  return at->second->as(options.vehicle, options.security, options.identity);
}

Bus::Bus(const BusSettings& settings, const std::string& process)
    : domain_(openDomain(optionsOf(settings))), participant_(domain_, process) {}

std::string Bus::place() const {
  return "domain " + std::to_string(options().domain) + ", interface " + options().interface +
         ", vehicle " + options().vehicle;
}

std::string Bus::whySilent(const std::string& topic, std::size_t matched) const {
  const std::string where = " (" + place() + ")";
  if (matched > 0) return topic + " has a writer, which has written nothing" + where;
  bus::Discovery discovery(participant_);
  for (const auto& endpoint : discovery.endpoints()) {
    if (!endpoint.writer || endpoint.wire_name != participant_.wireName(topic)) continue;
    return endpoint.process + " writes " + topic +
           " in a way that this version does not match: another version of Perdure, or other "
           "quality of service; `perdure doctor` compares them" +
           where;
  }
  return "nobody writes " + topic + where +
         "; start its service, or see with `perdure topics` where it runs";
}

void refuseTopic(const std::string& topic) {
  raise("UnknownTopic", "there is no topic " + topic + "; the topics are " + tools::knownTopics());
}

namespace {

class Publisher {
 public:
  /// Raises UnknownTopic if the topic does not exist.
  Publisher(std::shared_ptr<Bus> bus, const std::string& topic, std::int32_t strength,
            double lease_s)
      : bus_(std::move(bus)) {
    const auto make = [&]<class T>(const bus::Topic<T>& typed) {
      auto writer = std::make_unique<bus::Writer<T>>(
          bus_->participant(), typed, bus::WriterOptions{.strength = strength, .lease_s = lease_s});
      auto& to = *writer;
      writer_ = std::move(writer);
      const auto orRaise = [name = typed.name](const Result<void>& done) {
        if (done) return;
        raise("Refused", name + " was not written: " + done.error().code +
                             (done.error().detail.empty() ? "" : " of " + done.error().detail));
      };
      write_ = [&to, orRaise](py::handle message) {
        const T value = fromPython<T>(message);
        Result<void> done;
        {
          const py::gil_scoped_release waits;
          done = to.write(value);
        }
        orRaise(done);
      };
      dispose_ = [&to, orRaise](py::handle message) {
        orRaise(to.dispose(fromPython<T>(message)));
      };
    };
    if (!bus::withTopic(topic, make)) refuseTopic(topic);
  }

  void write(py::handle message) { write_(message); }
  void dispose(py::handle message) { dispose_(message); }
  std::size_t matched() const { return writer_->matched(); }
  bool waitForAcknowledgement(double seconds) {
    const py::gil_scoped_release waits;
    return writer_->waitForAcknowledgement(seconds);
  }

 private:
  const std::shared_ptr<Bus> bus_;
  std::unique_ptr<bus::RawWriter> writer_;
  std::function<void(py::handle)> write_, dispose_;
};

}  // namespace

void bindBus(py::module_& module) {
  using Text = std::optional<std::string>;
  py::class_<BusSettings>(module, "BusSettings")
      .def(py::init<Text, Text, Text, Text, std::optional<std::int64_t>,
                    std::optional<std::vector<std::string>>>(),
           py::kw_only(), py::arg("interface") = py::none(), py::arg("vehicle") = py::none(),
           py::arg("security") = py::none(), py::arg("identity") = py::none(),
           py::arg("domain") = py::none(), py::arg("peers") = py::none());
  py::class_<Bus, std::shared_ptr<Bus>>(module, "Bus")
      .def(py::init<const BusSettings&, const std::string&>(), py::arg("settings"),
           py::arg("process"), py::call_guard<py::gil_scoped_release>());
  py::class_<Publisher>(module, "Publisher")
      .def(py::init<std::shared_ptr<Bus>, const std::string&, std::int32_t, double>(),
           py::arg("bus"), py::arg("topic"), py::arg("strength"), py::arg("lease_s"))
      .def("write", &Publisher::write, py::arg("message"),
           "Raises Refused with the field and the reason if readers would reject the message.")
      .def("dispose", &Publisher::dispose, py::arg("message"),
           "Disposes of the instance with this message's key, for late joiners too.")
      .def("acknowledged", &Publisher::waitForAcknowledgement, py::arg("seconds"),
           "Waits until every reader has received all messages; False after ``seconds``.")
      .def_property_readonly("matched", &Publisher::matched, "The current number of readers.");
}

}  // namespace perdure::python

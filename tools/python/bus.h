// A process of Python's on the bus: one domain a process, participants as many as it asks for.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/endpoint.h"

namespace perdure::python {

/// What a caller says; the rest is said by bus.yaml and the environment, as for the commands.
struct BusSettings {
  std::optional<std::string> interface = {}, vehicle = {}, security = {}, identity = {};
  std::optional<std::int64_t> domain = {};
  std::optional<std::vector<std::string>> peers = {};
};
/// As the commands listen, without shared memory, under the identity "subscriber" where none is
/// named. Throws StartupError.
bus::Options optionsOf(const BusSettings& settings);
/// The same for a service: with shared memory, under the identity of its name.
bus::Options serviceOptionsOf(const BusSettings& settings, const std::string& process);

/// The domain of these options. DDS opens one once a process, and holds all its participants to
/// what the first one's identity may do: a second call gets the same. Throws StartupError where it
/// is open in another way.
bus::Domain openDomain(const bus::Options& options);

class Bus {
 public:
  Bus(const BusSettings& settings, const std::string& process);

  const bus::Participant& participant() const { return participant_; }
  const bus::Options& options() const { return domain_.options(); }
  /// "domain 0, interface lo, vehicle ego"
  std::string place() const;
  /// Why nothing has come on a topic, and the mend.
  std::string whySilent(const std::string& topic, std::size_t matched) const;

 private:
  bus::Domain domain_;
  bus::Participant participant_;
};

/// Any topic's writer, by its name.
class Publisher {
 public:
  /// Raises UnknownTopic.
  Publisher(std::shared_ptr<Bus> bus, const std::string& topic, std::int32_t strength,
            double lease_s);
  /// Raises Refused with the field and the reason.
  void write(pybind11::handle message);
  /// The key's instance is gone, for late joiners too.
  void dispose(pybind11::handle message);
  std::size_t matched() const { return writer_->matched(); }
  bool waitForAcknowledgement(double seconds);

 private:
  const std::shared_ptr<Bus> bus_;
  std::unique_ptr<bus::RawWriter> writer_;
  std::function<void(pybind11::handle)> write_, dispose_;
};

/// Raises UnknownTopic with the names that there are.
[[noreturn]] void refuseTopic(const std::string& topic);

void bindBus(pybind11::module_& module);

}  // namespace perdure::python

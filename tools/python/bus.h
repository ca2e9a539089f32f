// A Python process on the bus: one domain for each process, any number of participants.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/endpoint.h"

namespace perdure::python {

/// Settings of the caller; the others come from bus.yaml and the environment, as for the commands.
struct BusSettings {
  std::optional<std::string> interface = {}, vehicle = {}, security = {}, identity = {};
  std::optional<std::int64_t> domain = {};
  std::optional<std::vector<std::string>> peers = {};
};
/// Options of a subscriber, as for the commands: without shared memory, and with the default
/// identity "subscriber". Throws StartupError.
bus::Options optionsOf(const BusSettings& settings);
/// The same for a service: with shared memory, and with the identity of its name.
bus::Options serviceOptionsOf(const BusSettings& settings, const std::string& process);

/// The domain of these options. DDS opens a domain once in each process and restricts all
/// participants to the permissions of the first identity. A second call therefore returns the same
/// domain. Throws StartupError if the open domain has other options.
bus::Domain openDomain(const bus::Options& options);

class Bus {
 public:
  Bus(const BusSettings& settings, const std::string& process);

  const bus::Participant& participant() const { return participant_; }
  const bus::Options& options() const { return domain_.options(); }
  /// For example "domain 0, interface lo, vehicle ego".
  std::string place() const;
  /// Explains why no message arrived on a topic, with the fix.
  std::string whySilent(const std::string& topic, std::size_t matched) const;

 private:
  bus::Domain domain_;
  bus::Participant participant_;
};

/// A writer of any topic, selected by name.
class Publisher {
 public:
  /// Raises UnknownTopic.
  Publisher(std::shared_ptr<Bus> bus, const std::string& topic, std::int32_t strength,
            double lease_s);
  /// Raises Refused with the field and the reason.
  void write(pybind11::handle message);
  /// Disposes of the instance with the message's key, for late joiners too.
  void dispose(pybind11::handle message);
  std::size_t matched() const { return writer_->matched(); }
  bool waitForAcknowledgement(double seconds);

 private:
  const std::shared_ptr<Bus> bus_;
  std::unique_ptr<bus::RawWriter> writer_;
  std::function<void(pybind11::handle)> write_, dispose_;
};

/// Raises UnknownTopic with the existing names.
[[noreturn]] void refuseTopic(const std::string& topic);

void bindBus(pybind11::module_& module);

}  // namespace perdure::python

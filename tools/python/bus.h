// Connects a Python process to the bus: one domain per process, any number of participants.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>
#include <vector>

#include "common/bus/endpoint.h"

namespace perdure::python {

/// Settings of the caller. The others come from bus.yaml and the environment, as for the commands.
struct BusSettings {
  std::optional<std::string> interface = {}, vehicle = {}, security = {}, identity = {};
  std::optional<std::int64_t> domain = {};
  std::optional<std::vector<std::string>> peers = {};
};
/// Options of a service: with shared memory, and by default the identity `process`. Throws
/// StartupError for invalid settings.
bus::Options serviceOptionsOf(const BusSettings& settings, const std::string& process);

/// Opens the domain of these options. DDS opens a domain once per process and restricts all
/// participants to the permissions of the first identity. A second call therefore returns the same
/// domain. Throws StartupError if the open domain has other options.
bus::Domain openDomain(const bus::Options& options);

class Bus {
 public:
  Bus(const BusSettings& settings, const std::string& process);

  const bus::Participant& participant() const { return participant_; }
  const bus::Options& options() const { return domain_.options(); }
  /// Describes the connection, for example "domain 0, interface lo, vehicle ego".
  std::string place() const;
  /// Explains why no message arrived on a topic, with the fix.
  std::string whySilent(const std::string& topic, std::size_t matched) const;

 private:
  bus::Domain domain_;
  bus::Participant participant_;
};

/// Raises UnknownTopic with a list of the existing topics.
[[noreturn]] void refuseTopic(const std::string& topic);

}  // namespace perdure::python

// Where processes meet: the DDS domain, its network interface, and one participant a process.
#pragma once

#include <cstdint>
#include <string>

#include "common/config/fields.h"

namespace perdure::bus {

/// A DDS handle that is deleted with its owner.
class Entity {
 public:
  explicit Entity(std::int32_t handle = 0) : handle_(handle) {}
  ~Entity();
  Entity(Entity&& other) noexcept : handle_(other.handle_) { other.handle_ = 0; }
  Entity& operator=(Entity&& other) noexcept;
  std::int32_t handle() const { return handle_; }

 private:
  std::int32_t handle_;
};

struct Options {
  std::string interface = "lo";
  std::int64_t domain = 0;
  std::string vehicle = "ego";
};
/// bus.interface, bus.domain, bus.vehicle. The variable PERDURE_DOMAIN goes before bus.domain.
void describe(Options& options, config::Fields& fields);

/// The options with PERDURE_DOMAIN in force.
Options withEnvironment(Options options);

/// Cyclone's configuration for these options, as it may stand in CYCLONEDDS_URI.
std::string configurationXml(const Options& options);

/// One a process. Where CYCLONEDDS_URI is set it is used instead of bus.interface, as Cyclone does.
class Domain {
 public:
  /// Throws StartupError (69) where DDS cannot use the interface.
  explicit Domain(const Options& options);
  const Options& options() const { return options_; }

 private:
  Options options_;
  Entity domain_;
};

class Participant {
 public:
  /// `process` is shown by `perdure topics` and `perdure doctor`.
  Participant(const Domain& domain, const std::string& process);
  std::int32_t handle() const { return participant_.handle(); }
  /// "imu" → "perdure/ego/imu".
  std::string wireName(const std::string& topic) const { return prefix_ + topic; }

 private:
  Entity participant_;
  std::string prefix_;
};

}  // namespace perdure::bus

// The DDS domain, its network interface, and one participant per process.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/security/identity.h"
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

inline constexpr int kMaxDomain = 230;  ///< for higher domains DDS has no port numbers

struct Options {
  std::string interface = "lo";
  std::int64_t domain = 0;
  std::string vehicle = "ego";
  std::int64_t shared_memory_mb = 0;  ///< MB, largest image in shared memory; 0: none
  std::string security = {};          ///< folder of the identities; empty: no security
  std::string identity = {};          ///< a folder in `security`; empty: by process name
  /// Addresses of the other hosts; empty: hosts are found by multicast.
  std::vector<std::string> peers = {};
};
/// Describes bus.interface, bus.peers, bus.domain, bus.vehicle, bus.shared_memory_mb, bus.security
/// and bus.identity.
void describe(Options& options, config::Fields& fields);

/// Returns the options shared by all processes of a host, from the file that PERDURE_BUS names. If
/// PERDURE_BUS is not set, reads bus.yaml in `folder`, if it exists; if it is empty, reads no file.
/// Errors in the file are appended to `problems`.
Options commonOptions(const std::string& folder, std::vector<config::Problem>& problems);

/// Returns the options with the domain of PERDURE_DOMAIN, if that variable is set. Throws
/// StartupError (78) if its value is not a domain.
Options withEnvironment(Options options);

/// Returns the options as a value of CYCLONEDDS_URI. `locator`: the locator of shared memory;
/// empty: off. The identity is not included, because the participant sets it.
std::string configurationXml(const Options& options, const std::string& locator = {});
/// Returns the options as a value of CYCLONEDDS_URI for third-party programs, including the
/// identity if the options name one.
std::string foreignXml(const Options& options);

/// The state of shared memory at the start.
struct SharedMemory {
  std::string locator;         ///< empty: off
  std::string why_not;         ///< if requested but off: the cause and its fix
  std::size_t most_bytes = 0;  ///< per message
  bool on() const { return !locator.empty(); }
};

/// The DDS domain. A process has one for the bus, and may have a second one for third-party
/// programs. CYCLONEDDS_URI, if set, replaces bus.interface, bus.peers and bus.shared_memory_mb.
class Domain {
 public:
  /// Throws StartupError (69) if DDS cannot use the interface.
  explicit Domain(const Options& options);
  /// Returns a second domain in the same process, for third-party programs. It may have the number
  /// of the bus. Interfaces are separated by commas; empty: all that are up. Shared memory and
  /// security are off. Throws StartupError: 69 if DDS cannot use an interface, 78 if a name is
  /// invalid.
  static Domain foreign(Options options);
  /// Returns this domain for participants of another vehicle or with another identity.
  Domain as(std::string vehicle, std::string security, std::string identity) const;
  const Options& options() const { return options_; }
  const SharedMemory& sharedMemory() const { return shared_memory_; }
  /// Returns the present state of shared memory as text, with a fix if needed; empty if shared
  /// memory was not requested.
  std::string sharedMemoryText() const;
  /// Returns whether a process that starts now can share memory with this process.
  bool sharesMemory() const;
  const std::shared_ptr<const Entity>& entity() const { return domain_; }
  std::int64_t id() const { return id_; }

 private:
  Domain(Options options, SharedMemory memory);
  Domain(Options options, std::int64_t id, Entity domain);

  Options options_;
  SharedMemory shared_memory_;
  std::int64_t id_;  ///< Cyclone's id of the domain in this process
  std::shared_ptr<const Entity> domain_;
};

class Participant {
 public:
  /// `process` is the name that `perdure topics` and `perdure doctor` show. Throws StartupError
  /// (69) if the identity is not valid for bus.security, or if DDS refuses it.
  Participant(const Domain& domain, const std::string& process);
  std::int32_t handle() const { return participant_->handle(); }
  const SharedMemory& sharedMemory() const { return shared_memory_; }
  /// Returns `entity` as a shared pointer that keeps this participant alive.
  std::shared_ptr<const Entity> keep(Entity entity) const;
  /// "imu" → "perdure/ego/imu".
  std::string wireName(const std::string& topic) const { return prefix_ + topic; }
  /// Returns the identity of this participant, or nothing if bus.security is off.
  const std::optional<Identity>& identity() const { return identity_; }

 private:
  std::shared_ptr<const Entity> participant_;
  SharedMemory shared_memory_;
  std::string prefix_;
  std::optional<Identity> identity_;
};

}  // namespace perdure::bus

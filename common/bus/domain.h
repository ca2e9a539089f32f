// Where processes meet: the DDS domain, its network interface, and one participant a process.
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

struct Options {
  std::string interface = "lo";
  std::int64_t domain = 0;
  std::string vehicle = "ego";
  std::int64_t shared_memory_mb = 0;    ///< largest image that goes through it; 0: none does
  std::string security = {};            ///< folder of the identities; empty: open to all
  std::string identity = {};            ///< name of a folder in it; empty: by the process
  std::vector<std::string> peers = {};  ///< the other hosts; empty: by multicast
};
/// bus.interface, bus.peers, bus.domain, bus.vehicle, bus.shared_memory_mb, bus.security,
/// bus.identity. The variable PERDURE_DOMAIN goes before bus.domain.
void describe(Options& options, config::Fields& fields);

/// What all processes of a host have in common: the file that the variable PERDURE_BUS names
/// (empty: none), else bus.yaml in `folder`, where there is one. Adds what is wrong in it to
/// `problems`.
Options commonOptions(const std::string& folder, std::vector<config::Problem>& problems);

/// The options with PERDURE_DOMAIN in force.
Options withEnvironment(Options options);

/// Cyclone's configuration for these options, as it may stand in CYCLONEDDS_URI. `locator` is that
/// of shared memory; empty: without. Security is the participant's, and not in it.
std::string configurationXml(const Options& options, const std::string& locator = {});
/// The same for programs that are not ours, with the identity that the options name, if they do.
std::string foreignXml(const Options& options);

/// Shared memory, as it was found at the start.
struct SharedMemory {
  std::string locator;         ///< empty: off
  std::string why_not;         ///< where it is asked for and off, with the mend
  std::size_t most_bytes = 0;  ///< of a message
  bool on() const { return !locator.empty(); }
};

/// One a process, and one more for programs that are not ours. Where CYCLONEDDS_URI is set it is
/// used instead of bus.interface and bus.shared_memory_mb, as Cyclone does.
class Domain {
 public:
  /// Throws StartupError (69) where DDS cannot use the interface.
  explicit Domain(const Options& options);
  /// Another one in the same process, for programs that are not ours: `options.domain` stands as it
  /// is, and there is no shared memory and no security in it.
  static Domain foreign(Options options);
  /// The same domain, for participants of another vehicle or under another identity.
  Domain as(std::string vehicle, std::string security, std::string identity) const;
  const Options& options() const { return options_; }
  const SharedMemory& sharedMemory() const { return shared_memory_; }
  /// What there is to say of shared memory now, for people, with the mend; empty where it was not
  /// asked for.
  std::string sharedMemoryText() const;
  /// Who starts now shares memory with this process.
  bool sharesMemory() const;
  const std::shared_ptr<const Entity>& entity() const { return domain_; }

 private:
  Domain(Options options, SharedMemory memory);

  Options options_;
  SharedMemory shared_memory_;
  std::shared_ptr<const Entity> domain_;
};

class Participant {
 public:
  /// `process` is shown by `perdure topics` and `perdure doctor`. Throws StartupError where the
  /// identity is not fit for bus.security (69), or DDS refuses.
  Participant(const Domain& domain, const std::string& process);
  std::int32_t handle() const { return participant_->handle(); }
  const SharedMemory& sharedMemory() const { return shared_memory_; }
  /// An entity of this participant, which stays as long as that does.
  std::shared_ptr<const Entity> keep(Entity entity) const;
  /// "imu" → "perdure/ego/imu".
  std::string wireName(const std::string& topic) const { return prefix_ + topic; }
  /// Nothing where bus.security is off.
  const std::optional<Identity>& identity() const { return identity_; }

 private:
  std::shared_ptr<const Entity> participant_;
  SharedMemory shared_memory_;
  std::string prefix_;
  std::optional<Identity> identity_;
};

}  // namespace perdure::bus

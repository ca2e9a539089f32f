// The roles of identities under DDS-Security.
#pragma once

#include <cstdint>

namespace perdure::wire {

/// The services, the tools that record and play, and the roles of users.
enum class Role : std::uint32_t {
  kCapture = 1u << 0,
  kVio = 1u << 1,
  kInference = 1u << 2,
  kSemanticFilter = 1u << 3,
  kMapStore = 1u << 4,
  kRecord = 1u << 5,       ///< `perdure record`: reads all topics
  kOperator = 1u << 6,     ///< the other commands: read all topics, write queries and corrections
  kPlayer = 1u << 7,       ///< `perdure play`: writes all topics; created on request only
  kSubscriber = 1u << 8,   ///< third-party programs: read results, write map queries
  kGateway = 1u << 9,      ///< gateway: reads all topics, writes queries and corrections
  kRos2 = 1u << 10,        ///< the bridge to ROS 2 without inputs: reads all topics
  kRos2Driver = 1u << 11,  ///< the bridge with inputs: also writes their topics; on request only
};

class Roles {
 public:
  constexpr Roles() = default;
  constexpr Roles(Role role) : bits_(static_cast<std::uint32_t>(role)) {}
  constexpr Roles operator|(Roles more) const { return Roles(bits_ | more.bits_); }
  constexpr bool has(Role role) const { return (bits_ & static_cast<std::uint32_t>(role)) != 0; }

 private:
  constexpr explicit Roles(std::uint32_t bits) : bits_(bits) {}
  std::uint32_t bits_ = 0;
};
constexpr Roles operator|(Role a, Role b) { return Roles(a) | b; }

}  // namespace perdure::wire

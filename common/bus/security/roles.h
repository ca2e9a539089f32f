// Who may write and read which topic: the roles of identities under DDS-Security, and what the
// topic table grants to each.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace perdure::bus {

/// The services, what records and plays, and people.
enum class Role : std::uint32_t {
  kCapture = 1u << 0,
  kVio = 1u << 1,
  kInference = 1u << 2,
  kSemanticFilter = 1u << 3,
  kMapStore = 1u << 4,
  kRecord = 1u << 5,       ///< `perdure record`: reads everything
  kOperator = 1u << 6,     ///< the other commands: read everything, write queries
  kPlayer = 1u << 7,       ///< `perdure play`: writes everything; made on demand only
  kSubscriber = 1u << 8,   ///< programs of other people: results, and queries of the map
  kGateway = 1u << 9,      ///< shows what is on the bus: reads everything, writes queries
  kRos2 = 1u << 10,        ///< the bridge to ROS 2 outwards: reads everything
  kRos2Driver = 1u << 11,  ///< the bridge with inputs: also what they stand for; on demand only
};

/// A set of roles.
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

struct RoleName {
  Role role;
  std::string_view name;
};
std::span<const RoleName> roleNames();
/// Of a process, as its participant is called ("capture", "perdure doctor", "black_box"): the
/// identity that it takes where bus.identity says none.
std::string identityOf(const std::string& process);

}  // namespace perdure::bus

// The names of the roles of identities under DDS-Security.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/wire/roles.h"

namespace perdure::bus {

using wire::Role;
using wire::Roles;

struct RoleName {
  Role role;
  std::string_view name;
};
std::span<const RoleName> roleNames();
/// Returns the identity that the process uses if bus.identity is not set.
std::string identityOf(const std::string& process);

}  // namespace perdure::bus

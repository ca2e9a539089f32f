// The governance and permissions documents of DDS-Security 1.1, 9.4, from the topic table.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.h"
#include "tools/security/certificates.h"

namespace perdure::tools {

/// Governance: joining requires a certificate, all data are encrypted, and each read and write
/// needs a permission.
std::string governanceXml();

/// Topics that a role may write and read; "frame/*" stands for all cameras.
struct Permissions {
  std::vector<std::string> writes, reads;
};
Permissions permissionsOf(bus::Role role);

/// Permissions of one subject; all other topics are denied.
std::string permissionsXml(const Subject& subject, const std::string& vehicle,
                           const Permissions& permissions, const Validity& validity);

}  // namespace perdure::tools

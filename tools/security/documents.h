// The documents of DDS-Security 1.1, 9.4: protection and rights, from the topic table.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.h"
#include "tools/security/certificates.h"

namespace perdure::tools {

/// Joining requires a certificate, data are encrypted, each read and write needs a permission.
std::string governanceXml();

/// Topics that a role writes and reads; "frame/*" stands for all cameras.
struct Permissions {
  std::vector<std::string> writes, reads;
};
Permissions permissionsOf(bus::Role role);

/// All other topics are denied.
std::string permissionsXml(const Subject& subject, const std::string& vehicle,
                           const Permissions& permissions, const Validity& validity);

}  // namespace perdure::tools

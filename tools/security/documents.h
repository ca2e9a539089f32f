// The two documents of DDS-Security (OMG DDS Security 1.1, 9.4). They state the protection of the
// bus and the rights of each identity, generated from the topic table.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.h"
#include "tools/security/certificates.h"

namespace perdure::tools {

/// For every domain and every vehicle: joining requires a certificate, all data are encrypted, and
/// every read and write requires a permission.
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

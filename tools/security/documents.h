// The two documents of DDS-Security (OMG DDS Security 1.1, 9.4): what is protected on the bus, and
// what each identity may do, made from the topic table.
#pragma once

#include <string>
#include <vector>

#include "common/bus/topics.h"
#include "tools/security/certificates.h"

namespace perdure::tools {

/// For every domain and every vehicle: nobody joins without a certificate, everything is encrypted,
/// every read and write is a matter of permissions.
std::string governanceXml();

/// What a role writes and reads, as names of topics; "frame/*" stands for every camera.
struct Permissions {
  std::vector<std::string> writes, reads;
};
Permissions permissionsOf(bus::Role role);

/// All else is denied.
std::string permissionsXml(const Subject& subject, const std::string& vehicle,
                           const Permissions& permissions, const Validity& validity);

}  // namespace perdure::tools

// An identity under DDS-Security: a folder with a certificate, its key, its permissions, and the
// authority that verifies other identities. `perdure security` creates these folders.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace perdure::bus {

/// The names of the files in an identity's folder, in PEM or S/MIME format.
namespace identity_files {
inline constexpr char kCa[] = "ca.pem";            ///< certificate of the authority
inline constexpr char kRevoked[] = "revoked.pem";  ///< the authority's list of revoked certificates
inline constexpr char kCertificate[] = "certificate.pem";
inline constexpr char kKey[] = "key.pem";                  ///< readable by its owner only
inline constexpr char kGovernance[] = "governance.p7s";    ///< governance document of the domain
inline constexpr char kPermissions[] = "permissions.p7s";  ///< permissions document
}  // namespace identity_files

struct Identity {
  std::string name, role;  ///< CN and OU of the certificate's subject
  std::chrono::system_clock::time_point from, until;
};

/// Reads the folder, and repeats the checks of DDS to give clear error messages. All files must
/// exist and be readable. The key must belong to the certificate and be readable by its owner only.
/// The certificate must be issued by this authority, not revoked, and valid now. Codes:
/// file_missing, file_unreadable, key_open, key_wrong, authority_wrong, revoked, not_yet_valid,
/// expired, file_malformed. The detail states the fix.
Result<Identity> readIdentity(const std::string& folder);

/// Returns the identity as properties of a participant's QoS ("dds.sec.auth.private_key", …);
/// securityXml() returns it as XML for CYCLONEDDS_URI.
std::vector<std::pair<std::string, std::string>> securityProperties(const std::string& folder);
std::string securityXml(const std::string& folder);

/// Returns the time from now as text, for example "in 12 days", "in 3 hours" or "2 days ago".
std::string fromNow(std::chrono::system_clock::time_point at);

/// An identity should be renewed this long before it expires.
inline constexpr std::chrono::hours kRenewBefore{24 * 14};

}  // namespace perdure::bus

// An identity under DDS-Security: a folder with a certificate, its key, its permissions, and the
// authority that verifies other identities. `perdure security` creates these folders.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace perdure::bus {

/// The files of an identity's folder, PEM and S/MIME.
namespace identity_files {
inline constexpr char kCa[] = "ca.pem";            ///< authority of identities and documents
inline constexpr char kRevoked[] = "revoked.pem";  ///< the authority's list of revoked certificates
inline constexpr char kCertificate[] = "certificate.pem";
inline constexpr char kKey[] = "key.pem";                  ///< readable by its owner only
inline constexpr char kGovernance[] = "governance.p7s";    ///< protection rules of the domain
inline constexpr char kPermissions[] = "permissions.p7s";  ///< permissions of this identity
}  // namespace identity_files

struct Identity {
  std::string name, role;  ///< subject: CN, OU
  std::chrono::system_clock::time_point from, until;
};

/// Reads the folder and repeats the checks of DDS with clear error messages. Files must exist and
/// be readable. The key must belong to the certificate and be readable by its owner only. The
/// certificate must be issued by this authority, not revoked, and valid now.
/// Codes: file_missing, file_unreadable, key_open, key_wrong, authority_wrong, revoked,
/// not_yet_valid, expired, file_malformed. The detail states the fix.
Result<Identity> readIdentity(const std::string& folder);

/// The identity as properties of a participant's QoS ("dds.sec.auth.private_key", …), and as XML
/// for CYCLONEDDS_URI.
std::vector<std::pair<std::string, std::string>> securityProperties(const std::string& folder);
std::string securityXml(const std::string& folder);

/// The time from now, for example "in 12 days", "in 3 hours", "2 days ago".
std::string fromNow(std::chrono::system_clock::time_point at);

/// The time before its end at which an identity should be renewed.
inline constexpr std::chrono::hours kRenewBefore{24 * 14};

}  // namespace perdure::bus

// An identity under DDS-Security: a folder with a certificate and its key, what it may do, and by
// whom others are judged. `perdure security` makes them.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace perdure::bus {

/// The files of an identity's folder, PEM and S/MIME.
namespace identity_files {
inline constexpr char kCa[] = "ca.pem";            ///< of identities and documents
inline constexpr char kRevoked[] = "revoked.pem";  ///< its list of revoked certificates
inline constexpr char kCertificate[] = "certificate.pem";
inline constexpr char kKey[] = "key.pem";                  ///< for its owner alone
inline constexpr char kGovernance[] = "governance.p7s";    ///< what is protected, and how
inline constexpr char kPermissions[] = "permissions.p7s";  ///< what this identity may do
}  // namespace identity_files

struct Identity {
  std::string name, role;  ///< subject: CN, OU
  std::chrono::system_clock::time_point from, until;
};

/// Reads the folder and checks what DDS would check, but in words: files there and readable, key
/// closed to others and of this certificate, certificate of this authority, not revoked, valid now.
/// Codes: file_missing, file_unreadable, key_open, key_wrong, authority_wrong, revoked,
/// not_yet_valid, expired, file_malformed. The detail says the mend.
Result<Identity> readIdentity(const std::string& folder);

/// The same for a participant's QoS ("dds.sec.auth.private_key", …) and as XML for CYCLONEDDS_URI.
std::vector<std::pair<std::string, std::string>> securityProperties(const std::string& folder);
std::string securityXml(const std::string& folder);

/// "in 12 days", "in 3 hours", "2 days ago".
std::string fromNow(std::chrono::system_clock::time_point at);

/// So long before its end an identity is to be renewed.
inline constexpr std::chrono::hours kRenewBefore{24 * 14};

}  // namespace perdure::bus

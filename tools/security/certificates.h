// X.509 and S/MIME by OpenSSL: keys on P-256, signatures ECDSA with SHA-256, as DDS-Security asks.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "common/bus/security/openssl.h"

namespace perdure::tools {

using TimePoint = std::chrono::system_clock::time_point;

struct Validity {
  TimePoint from, until;
};
/// From an hour ago, for hosts whose clock is behind.
Validity validFor(double days);

/// The subject of a certificate, as DDS's permissions write it too (RFC 2253).
struct Subject {
  std::string name;  ///< CN
  std::string role;  ///< OU
  std::string text() const;
};

bus::Key makeKey();
/// Signed by itself.
bus::Certificate makeAuthority(EVP_PKEY* key, const Validity& validity);

/// Who signs. Both live as long as it does.
struct Signer {
  X509* certificate;
  EVP_PKEY* key;
};
bus::Certificate issue(const Signer& authority, EVP_PKEY* key, const Subject& subject,
                       const Validity& validity);
/// Certificates of `revoked` are refused, besides those of `before` (may be nullptr).
bus::RevokedList makeRevokedList(const Signer& authority, const X509_CRL* before,
                                 const std::vector<const X509*>& revoked);
/// A document as S/MIME with its signature.
std::string signedDocument(const Signer& authority, const std::string& xml);

std::string toPem(X509* certificate);
std::string toPem(X509_CRL* revoked);
std::string toPem(EVP_PKEY* key);

}  // namespace perdure::tools

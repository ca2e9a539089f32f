// Certificates and signatures (X.509, S/MIME) with OpenSSL: P-256 and ECDSA with SHA-256, as
// DDS-Security requires.
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
/// A validity that starts an hour ago, because the clock of a host may be slow.
Validity validFor(double days);

/// The subject of a certificate, in the form that the permissions of DDS use (RFC 2253).
struct Subject {
  std::string name;  ///< CN
  std::string role;  ///< OU
  std::string text() const;
};

bus::Key makeKey();
bus::Certificate makeAuthority(EVP_PKEY* key, const Validity& validity);

/// The signing authority. Certificate and key must outlive the signer.
struct Signer {
  X509* certificate;
  EVP_PKEY* key;
};
bus::Certificate issue(const Signer& authority, EVP_PKEY* key, const Subject& subject,
                       const Validity& validity);
/// A list that revokes `revoked` and all certificates of `before` (may be nullptr).
bus::RevokedList makeRevokedList(const Signer& authority, const X509_CRL* before,
                                 const std::vector<const X509*>& revoked);
/// The document with its signature, as S/MIME.
std::string signedDocument(const Signer& authority, const std::string& xml);

std::string toPem(X509* certificate);
std::string toPem(X509_CRL* revoked);
std::string toPem(EVP_PKEY* key);

}  // namespace perdure::tools

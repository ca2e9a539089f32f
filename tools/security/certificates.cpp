#include "tools/security/certificates.h"

#include <openssl/err.h>
#include <openssl/pkcs7.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

using bus::Bio;
using bus::Freed;
using Number = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using Integer = std::unique_ptr<ASN1_INTEGER, Freed<ASN1_INTEGER_free>>;
using Time = std::unique_ptr<ASN1_TIME, Freed<ASN1_TIME_free>>;
using Name = std::unique_ptr<X509_NAME, Freed<X509_NAME_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
using Signature = std::unique_ptr<PKCS7, Freed<PKCS7_free>>;

constexpr char kOrganisation[] = "perdure";
constexpr char kAuthorityName[] = "perdure authority";

/// Throws if an OpenSSL call failed. This happens only without memory or random numbers.
void require(bool done, const char* what) {
  if (done) return;
  char reason[256] = "";
  ERR_error_string_n(ERR_get_error(), reason, sizeof reason);
  throw StartupError(ExitCode::kFailure, std::string("OpenSSL cannot ") + what + ": " + reason);
}

Time timeOf(TimePoint at) {
  return Time(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(at)));
}

Integer randomSerial() {
  constexpr int kBits = 159;  // bits of a serial number: positive, at most 20 octets
  const Number number(BN_new());
  require(number && BN_rand(number.get(), kBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1,
          "draw a serial number");
  return Integer(BN_to_ASN1_INTEGER(number.get(), nullptr));
}

void add(X509_NAME* name, const char* field, const std::string& value) {
  require(X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8,
                                     reinterpret_cast<const unsigned char*>(value.data()),
                                     static_cast<int>(value.size()), -1, 0) == 1,
          "write a name");
}

Name nameOf(const Subject& subject) {
  Name name(X509_NAME_new());
  add(name.get(), "O", kOrganisation);
  if (!subject.role.empty()) add(name.get(), "OU", subject.role);
  add(name.get(), "CN", subject.name);
  return name;
}

void addExtension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value));
  require(extension && X509_add_ext(certificate, extension.get(), -1) == 1, "add an extension");
}

bus::Certificate blank(EVP_PKEY* key, const Subject& subject, const Validity& validity) {
  bus::Certificate certificate(X509_new());
  X509* const made = certificate.get();
  constexpr long kVersion3 = 2;
  X509_set_version(made, kVersion3);
  X509_set_serialNumber(made, randomSerial().get());
  X509_set1_notBefore(made, timeOf(validity.from).get());
  X509_set1_notAfter(made, timeOf(validity.until).get());
  X509_set_subject_name(made, nameOf(subject).get());
  require(X509_set_pubkey(made, key) == 1, "put a key into a certificate");
  return certificate;
}

template <class Write>
std::string pem(Write write) {
  const Bio memory(BIO_new(BIO_s_mem()));
  require(memory && write(memory.get()) == 1, "write PEM");
  char* text = nullptr;
  const long length = BIO_get_mem_data(memory.get(), &text);
  return {text, static_cast<std::size_t>(length)};
}

}  // namespace

Validity validFor(double days) {
  const auto now = std::chrono::system_clock::now();
  const auto length = std::chrono::duration<double, std::ratio<86400>>(days);
  return {now - std::chrono::hours(1),
          now + std::chrono::duration_cast<std::chrono::system_clock::duration>(length)};
}

std::string Subject::text() const {
  const Bio memory(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(memory.get(), nameOf(*this).get(), 0, XN_FLAG_RFC2253);
  char* text = nullptr;
  const long length = BIO_get_mem_data(memory.get(), &text);
  return {text, static_cast<std::size_t>(length)};
}

bus::Key makeKey() {
  bus::Key key(EVP_EC_gen("P-256"));
  require(key != nullptr, "make a key");
  return key;
}

bus::Certificate makeAuthority(EVP_PKEY* key, const Validity& validity) {
  bus::Certificate certificate = blank(key, {kAuthorityName, {}}, validity);
  X509* const made = certificate.get();
  X509_set_issuer_name(made, X509_get_subject_name(made));
  addExtension(made, made, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  addExtension(made, made, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature");
  addExtension(made, made, NID_subject_key_identifier, "hash");
  require(X509_sign(made, key, EVP_sha256()) > 0, "sign a certificate");
  return certificate;
}

bus::Certificate issue(const Signer& authority, EVP_PKEY* key, const Subject& subject,
                       const Validity& validity) {
  bus::Certificate certificate = blank(key, subject, validity);
  X509* const made = certificate.get();
  X509_set_issuer_name(made, X509_get_subject_name(authority.certificate));
  addExtension(made, authority.certificate, NID_basic_constraints, "critical,CA:FALSE");
  addExtension(made, authority.certificate, NID_key_usage, "critical,digitalSignature");
  addExtension(made, authority.certificate, NID_authority_key_identifier, "keyid");
  require(X509_sign(made, authority.key, EVP_sha256()) > 0, "sign a certificate");
  return certificate;
}

bus::RevokedList makeRevokedList(const Signer& authority, const X509_CRL* before,
                                 const std::vector<const X509*>& revoked) {
  bus::RevokedList list(before != nullptr ? X509_CRL_dup(before) : X509_CRL_new());
  X509_CRL* const made = list.get();
  constexpr long kVersion2 = 1;
  X509_CRL_set_version(made, kVersion2);
  X509_CRL_set_issuer_name(made, X509_get_subject_name(authority.certificate));
  const Time now = timeOf(std::chrono::system_clock::now() - std::chrono::hours(1));
  X509_CRL_set1_lastUpdate(made, now.get());
  // The list is valid as long as the authority, because an outdated list must not stop a vehicle.
  X509_CRL_set1_nextUpdate(made, X509_get0_notAfter(authority.certificate));
  for (const X509* certificate : revoked) {
    X509_REVOKED* entry = X509_REVOKED_new();
    X509_REVOKED_set_serialNumber(entry,
                                  const_cast<ASN1_INTEGER*>(X509_get0_serialNumber(certificate)));
    X509_REVOKED_set_revocationDate(entry, now.get());
    require(X509_CRL_add0_revoked(made, entry) == 1, "revoke a certificate");
  }
  X509_CRL_sort(made);
  require(X509_CRL_sign(made, authority.key, EVP_sha256()) > 0, "sign a list");
  return list;
}

std::string signedDocument(const Signer& authority, const std::string& xml) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED;
  const Bio text(BIO_new_mem_buf(xml.data(), static_cast<int>(xml.size())));
  const Signature signature(
      PKCS7_sign(authority.certificate, authority.key, nullptr, text.get(), kFlags));
  require(signature != nullptr, "sign a document");
  (void)BIO_reset(text.get());
  return pem([&](BIO* out) { return SMIME_write_PKCS7(out, signature.get(), text.get(), kFlags); });
}

std::string toPem(X509* certificate) {
  return pem([&](BIO* out) { return PEM_write_bio_X509(out, certificate); });
}
std::string toPem(X509_CRL* revoked) {
  return pem([&](BIO* out) { return PEM_write_bio_X509_CRL(out, revoked); });
}
std::string toPem(EVP_PKEY* key) {
  return pem([&](BIO* out) {
    return PEM_write_bio_PKCS8PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr);
  });
}

}  // namespace perdure::tools

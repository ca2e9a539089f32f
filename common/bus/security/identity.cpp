#include "common/bus/security/identity.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <memory>

#include "common/bus/security/openssl.h"

namespace perdure::bus {
namespace {

using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE_free>>;
using Verification = std::unique_ptr<X509_STORE_CTX, Freed<X509_STORE_CTX_free>>;

constexpr char kRenew[] =
    "`perdure security renew` on the host of the authority, and its folder here";

std::string pathOf(const std::string& folder, const char* file) { return folder + "/" + file; }

Result<void> requireFiles(const std::string& folder) {
  using namespace identity_files;
  for (const char* file : {kCa, kRevoked, kCertificate, kKey, kGovernance, kPermissions}) {
    const std::string path = pathOf(folder, file);
    if (access(path.c_str(), R_OK) == 0) continue;
    if (errno == EACCES) {
      return fail("file_unreadable",
                  "{} cannot be read by this user; run as its owner (sudo), or give the identity "
                  "to this one: chown -R USER {}",
                  path, folder);
    }
    return fail("file_missing",
                fmt::format("{} is missing; `perdure security init` makes the identities of the "
                            "services, `perdure security add` others; then copy the folder here",
                            path));
  }
  struct stat key {};
  const std::string path = pathOf(folder, kKey);
  if (stat(path.c_str(), &key) == 0 && (key.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return fail("key_open", fmt::format("{} can be read by others: chmod 600 {}", path, path));
  }
  return {};
}

std::string subjectPart(const X509* certificate, int nid) {
  char text[128] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), nid, text, sizeof text);
  return text;
}

std::chrono::system_clock::time_point timeOf(const ASN1_TIME* time) {
  std::tm parts{};
  ASN1_TIME_to_tm(time, &parts);
  return std::chrono::system_clock::from_time_t(timegm(&parts));
}

/// Returns X509_V_OK if the certificate is accepted; otherwise OpenSSL's code of the reason.
int verify(X509* certificate, X509* authority, X509_CRL* revoked) {
  const Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  X509_STORE_add_crl(store.get(), revoked);
  const Verification context(X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), certificate, nullptr);
  X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_CRL_CHECK);
  if (X509_verify_cert(context.get()) == 1) return X509_V_OK;
  return X509_STORE_CTX_get_error(context.get());
}

Result<void> judge(int verdict, const std::string& folder, const Identity& identity) {
  const std::string who = fmt::format("the identity {} ({})", identity.name, folder);
  switch (verdict) {
    case X509_V_OK:
      return {};
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return fail("expired", fmt::format("{} ended {}; {}", who, fromNow(identity.until), kRenew));
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return fail("not_yet_valid", fmt::format("{} begins {}; is this host's clock right?", who,
                                               fromNow(identity.from)));
    case X509_V_ERR_CERT_REVOKED:
      return fail("revoked", fmt::format("{} was revoked; {}", who, kRenew));
    default:
      return fail("authority_wrong",
                  fmt::format("{} is not of the authority in its {} ({}); copy the whole folder "
                              "from the host of the authority",
                              who, identity_files::kCa, X509_verify_cert_error_string(verdict)));
  }
}

struct Item {
  const char* property;
  const char* section;
  const char* element;
  const char* file;
};
constexpr Item kItems[] = {
    {"dds.sec.auth.identity_certificate", "Authentication", "IdentityCertificate",
     identity_files::kCertificate},
    {"dds.sec.auth.identity_ca", "Authentication", "IdentityCA", identity_files::kCa},
    {"dds.sec.auth.private_key", "Authentication", "PrivateKey", identity_files::kKey},
    {"org.eclipse.cyclonedds.sec.auth.crl", "Authentication", "CRL", identity_files::kRevoked},
    {"dds.sec.access.permissions_ca", "AccessControl", "PermissionsCA", identity_files::kCa},
    {"dds.sec.access.governance", "AccessControl", "Governance", identity_files::kGovernance},
    {"dds.sec.access.permissions", "AccessControl", "Permissions", identity_files::kPermissions},
};
/// Cyclone's own security plugins, by their default names.
constexpr const char* kPlugins[][3] = {{"auth", "Authentication", "authentication"},
                                       {"access", "AccessControl", "access_control"},
                                       {"crypto", "Cryptographic", "crypto"}};

std::string libraryOf(const std::string& plugin) {
  return "dds_security_" + (plugin == "access" ? "ac" : plugin);
}

std::string itemsXml(const std::string& section, const std::string& folder) {
  std::string xml;
  for (const Item& item : kItems) {
    if (section != item.section) continue;
    xml += fmt::format("<{0}>file:{1}</{0}>", item.element, pathOf(folder, item.file));
  }
  return xml;
}

}  // namespace

Result<Identity> readIdentity(const std::string& folder) {
  if (auto files = requireFiles(folder); !files) return tl::unexpected(files.error());
  using namespace identity_files;
  const auto certificate = readCertificate(pathOf(folder, kCertificate));
  const auto authority = readCertificate(pathOf(folder, kCa));
  const auto revoked = readRevokedList(pathOf(folder, kRevoked));
  const auto key = readKey(pathOf(folder, kKey));
  if (!certificate || !authority || !revoked || !key) {
    const char* file = !certificate ? kCertificate : !authority ? kCa : !revoked ? kRevoked : kKey;
    return fail("file_malformed", "{} is no PEM of its kind; copy the folder again, or {}",
                pathOf(folder, file), kRenew);
  }
  Identity identity{subjectPart(certificate.get(), NID_commonName),
                    subjectPart(certificate.get(), NID_organizationalUnitName),
                    timeOf(X509_get0_notBefore(certificate.get())),
                    timeOf(X509_get0_notAfter(certificate.get()))};
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    return fail("key_wrong", fmt::format("{} is not the key of {}; copy the whole folder again",
                                         pathOf(folder, kKey), kCertificate));
  }
  const auto judged =
      judge(verify(certificate.get(), authority.get(), revoked.get()), folder, identity);
  if (!judged) return tl::unexpected(judged.error());
  return identity;
}

std::vector<std::pair<std::string, std::string>> securityProperties(const std::string& folder) {
  std::vector<std::pair<std::string, std::string>> properties;
  for (const Item& item : kItems) {
    properties.emplace_back(item.property, "file:" + pathOf(folder, item.file));
  }
  for (const auto& [plugin, section, function] : kPlugins) {
    const std::string prefix = fmt::format("dds.sec.{}.library.", plugin);
    properties.emplace_back(prefix + "path", libraryOf(plugin));
    properties.emplace_back(prefix + "init", fmt::format("init_{}", function));
    properties.emplace_back(prefix + "finalize", fmt::format("finalize_{}", function));
  }
  return properties;
}

std::string securityXml(const std::string& folder) {
  std::string xml = "<Security>";
  for (const auto& [plugin, section, function] : kPlugins) {
    xml += fmt::format(
        "<{0}><Library path=\"{1}\" initFunction=\"init_{2}\" finalizeFunction=\"finalize_{2}\"/>"
        "{3}</{0}>",
        section, libraryOf(plugin), function, itemsXml(section, folder));
  }
  return xml + "</Security>";
}

std::string fromNow(std::chrono::system_clock::time_point at) {
  using namespace std::chrono;
  const auto distance = at - system_clock::now();
  const auto length = distance < 0s ? -distance : distance;
  const auto [n, unit] = length >= 48h    ? std::pair(length / 24h, "days")
                         : length >= 2h   ? std::pair(length / 1h, "hours")
                         : length >= 2min ? std::pair(length / 1min, "minutes")
                                          : std::pair(length / 1s, "seconds");
  return distance < 0s ? fmt::format("{} {} ago", n, unit) : fmt::format("in {} {}", n, unit);
}

}  // namespace perdure::bus

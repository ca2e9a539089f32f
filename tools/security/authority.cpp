#include "tools/security/authority.h"

#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/bus/security/identity.h"
#include "tools/security/private_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace bus::identity_files;

constexpr char kAuthority[] = "authority", kRegister[] = "identities.json", kIssued[] = "issued";
constexpr mode_t kForOwner = S_IRUSR | S_IWUSR;

bus::Role roleNamed(const std::string& name) {
  std::string known;
  for (const auto& [role, role_name] : bus::roleNames()) {
    if (name == role_name) return role;
    known += (known.empty() ? "" : ", ") + std::string(role_name);
  }
  throw StartupError(ExitCode::kUsage, "there is no role " + name + "; the roles are " + known);
}

void requireName(const std::string& name) {
  static const std::regex kName("[A-Za-z0-9][A-Za-z0-9_-]{0,47}");
  if (std::regex_match(name, kName) && name != kAuthority) return;
  throw StartupError(ExitCode::kUsage,
                     "\"" + name +
                         "\" is no name for an identity: letters, digits, _ and -, at "
                         "most 48, and not \"authority\"");
}

/// Replaces the topics that the role reads by `topics`, if there are any. For a ros2_driver,
/// replaces those that it writes; throws StartupError if it may not write one.
void choose(Permissions& permissions, bus::Role role, const std::vector<std::string>& topics) {
  if (topics.empty()) return;
  if (role != bus::Role::kRos2Driver) {
    permissions.reads = topics;
    return;
  }
  for (const std::string& topic : topics) {
    const std::string row = topic.starts_with("frame/") ? "frame/*" : topic;
    const auto& all = permissions.writes;
    if (std::ranges::find(all, row) != all.end()) continue;
    throw StartupError(ExitCode::kUsage, "a ros2_driver stands for no " + topic);
  }
  permissions.writes = topics;
  permissions.writes.emplace_back("health");
}

void requireTopics(const std::vector<std::string>& topics) {
  for (const std::string& topic : topics) {
    if (bus::findTopic(topic) != nullptr) continue;
    throw StartupError(ExitCode::kUsage,
                       "there is no topic " + topic + "; `perdure topics` lists them");
  }
}

std::optional<Owner> ownerOf(const fs::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return Owner{status.st_uid, status.st_gid};
}

}  // namespace

Authority Authority::create(const fs::path& folder, const std::string& vehicle, double days) {
  const fs::path own = folder / kAuthority;
  std::error_code error;
  if (fs::exists(own / kKey, error)) {
    throw StartupError(ExitCode::kUsage,
                       own.string() +
                           " is there already; `perdure security add` and `renew` "
                           "go on with it, and only an empty folder takes a new one");
  }
  fs::create_directories(folder, error);
  makePrivateFolder(own);
  makePrivateFolder(own / kIssued);
  Authority made;
  made.folder_ = folder;
  made.vehicle_ = vehicle;
  made.key_ = makeKey();
  made.certificate_ = makeAuthority(made.key_.get(), validFor(days));
  made.revoked_ = makeRevokedList(made.signer(), nullptr, {});
  writePrivate(own / kCa, toPem(made.certificate_.get()), kForOwner);
  writePrivate(own / kRevoked, toPem(made.revoked_.get()), kForOwner);
  writePrivate(own / kGovernance, signedDocument(made.signer(), governanceXml()), kForOwner);
  made.save();
  // Written last, because this file marks a complete authority.
  writePrivate(own / kKey, toPem(made.key_.get()), kForOwner);
  return made;
}

Authority::Authority(const fs::path& folder) : folder_(folder) {
  const fs::path own = folder / kAuthority;
  key_ = bus::readKey(own / kKey);
  certificate_ = bus::readCertificate(own / kCa);
  revoked_ = bus::readRevokedList(own / kRevoked);
  const auto json = nlohmann::json::parse(textOf(own / kRegister), nullptr, false);
  if (!key_ || !certificate_ || !revoked_ || !json.is_object()) {
    throw StartupError(ExitCode::kUnavailable,
                       "{} holds no authority that this user can read; `perdure security init` "
                       "makes one, --dir names another folder",
                       own.string());
  }
  vehicle_ = json.value("vehicle", "ego");
  const auto identities = json.value("identities", nlohmann::json::object());
  for (const auto& [name, entry] : identities.items()) {
    known_[name] = {entry.value("role", ""), entry.value("topics", std::vector<std::string>())};
  }
}

void Authority::save() const {
  nlohmann::ordered_json json{{"vehicle", vehicle_},
                              {"identities", nlohmann::ordered_json::object()}};
  for (const auto& [name, known] : known_) {
    json["identities"][name] = {{"role", known.role}, {"topics", known.topics}};
  }
  writePrivate(folder_ / kAuthority / kRegister, json.dump(1) + "\n", kForOwner);
}

void Authority::add(const Wanted& wanted, const Validity& validity) {
  requireName(wanted.name);
  requireTopics(wanted.topics);
  (void)roleNamed(wanted.role);
  if (known_.contains(wanted.name)) {
    throw StartupError(ExitCode::kUsage, "there is an identity " + wanted.name +
                                             " already; `perdure security renew " + wanted.name +
                                             "` makes new keys for it");
  }
  const Known known{wanted.role, wanted.topics};
  write(wanted.name, known, validity, wanted.owner);
  known_[wanted.name] = known;
  save();
}

void Authority::renew(const std::string& name, const Validity& validity) {
  const auto known = known_.find(name);
  if (known == known_.end()) {
    throw StartupError(ExitCode::kUsage, "there is no identity " + name +
                                             "; `perdure security list` shows those there are");
  }
  write(name, known->second, validity, {});
}

void Authority::write(const std::string& name, const Known& known, const Validity& validity,
                      const std::string& owner_name) {
  const fs::path folder = folder_ / name, own = folder_ / kAuthority;
  const auto owner = owner_name.empty() ? ownerOf(folder) : ownerNamed(owner_name);
  const Subject subject{name, known.role};
  Permissions permissions = permissionsOf(roleNamed(known.role));
  choose(permissions, roleNamed(known.role), known.topics);
  const bus::Key key = makeKey();
  const bus::Certificate certificate = issue(signer(), key.get(), subject, validity);
  const std::string pem = toPem(certificate.get());
  makePrivateFolder(folder, owner);
  const auto put = [&](const char* file, const std::string& text) {
    writePrivate(folder / file, text, kForOwner, owner);
  };
  // The certificate is recorded before it is used, so that every issued certificate can be revoked.
  const fs::path record = own / kIssued / (name + ".pem");
  writePrivate(record, textOf(record) + pem, kForOwner);
  put(kCa, toPem(certificate_.get()));
  put(kRevoked, toPem(revoked_.get()));
  put(kGovernance, textOf(own / kGovernance));
  put(kPermissions,
      signedDocument(signer(), permissionsXml(subject, vehicle_, permissions, validity)));
  put(kKey, toPem(key.get()));
  put(kCertificate, pem);
}

void Authority::revoke(const std::string& name) {
  const fs::path own = folder_ / kAuthority;
  const bus::Bio issued(BIO_new_file((own / kIssued / (name + ".pem")).c_str(), "r"));
  std::vector<bus::Certificate> certificates;
  while (issued) {
    bus::Certificate next(PEM_read_bio_X509(issued.get(), nullptr, nullptr, nullptr));
    if (!next) break;
    X509_REVOKED* found = nullptr;
    if (X509_CRL_get0_by_cert(revoked_.get(), &found, next.get()) != 1) {
      certificates.push_back(std::move(next));
    }
  }
  if (certificates.empty()) {
    throw StartupError(ExitCode::kUsage, "there is nothing to revoke: " + name +
                                             " has no certificate, or only revoked ones");
  }
  std::vector<const X509*> all;
  for (const auto& certificate : certificates) all.push_back(certificate.get());
  revoked_ = makeRevokedList(signer(), revoked_.get(), all);
  const std::string pem = toPem(revoked_.get());
  writePrivate(own / kRevoked, pem, kForOwner);
  for (const auto& [other, known] : known_) {
    const fs::path folder = folder_ / other;
    if (fs::exists(folder)) writePrivate(folder / kRevoked, pem, kForOwner, ownerOf(folder));
  }
}

std::vector<std::string> Authority::names() const {
  std::vector<std::string> names;
  for (const auto& [name, known] : known_) names.push_back(name);
  return names;
}

}  // namespace perdure::tools

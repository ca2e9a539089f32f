// The folder of bus.security with its authority: makes, renews and revokes identities.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/security/documents.h"

namespace perdure::tools {

/// FOLDER/authority: the authority's key, which no vehicle needs, and what it has issued.
/// FOLDER/NAME: an identity, all that its host needs (common/bus/security/identity.h).
class Authority {
 public:
  /// A new one. Throws StartupError where the folder has one, or cannot be written.
  static Authority create(const std::filesystem::path& folder, const std::string& vehicle,
                          double days);
  /// Throws StartupError where there is none, or its key cannot be read.
  explicit Authority(const std::filesystem::path& folder);

  struct Wanted {
    std::string name, role;
    /// Read instead of the role's, "frame/*" among them; of a ros2_driver what it writes.
    std::vector<std::string> topics = {};
    std::string owner = {};  ///< user of the files; empty: as they are, or ours
  };
  /// Throws StartupError: a name that is taken or is none, an unknown role, topic or user.
  void add(const Wanted& wanted, const Validity& validity);
  /// New key, certificate and permissions; the old ones go on until their end, or are revoked.
  void renew(const std::string& name, const Validity& validity);
  /// Every certificate that this name was ever given. The list goes into each folder here; other
  /// hosts need it too, and who runs takes it at its next start.
  void revoke(const std::string& name);
  std::vector<std::string> names() const;
  const std::string& vehicle() const { return vehicle_; }

 private:
  struct Known {
    std::string role;
    std::vector<std::string> topics;
  };
  Authority() = default;
  void write(const std::string& name, const Known& known, const Validity& validity,
             const std::string& owner);
  void save() const;
  Signer signer() const { return {certificate_.get(), key_.get()}; }

  std::filesystem::path folder_;
  std::string vehicle_;
  bus::Key key_;
  bus::Certificate certificate_;
  bus::RevokedList revoked_;
  std::map<std::string, Known> known_;
};

}  // namespace perdure::tools

// The folder of bus.security and its authority, which creates, renews and revokes identities.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tools/security/documents.h"

namespace perdure::tools {

/// FOLDER/authority contains the authority's key, which no vehicle needs, and the issued
/// certificates. FOLDER/NAME is an identity with all files that its host needs
/// (common/bus/security/identity.h).
class Authority {
 public:
  /// Creates an authority. Throws StartupError if the folder already has one or cannot be written.
  static Authority create(const std::filesystem::path& folder, const std::string& vehicle,
                          double days);
  /// Opens an authority. Throws StartupError if there is none, or its key cannot be read.
  explicit Authority(const std::filesystem::path& folder);

  struct Wanted {
    std::string name, role;
    /// Topics to read instead of the role's default, or to write for a ros2_driver; also "frame/*".
    std::vector<std::string> topics = {};
    std::string owner = {};  ///< user of the files; empty: unchanged, or the current user
  };
  /// Adds an identity. Throws StartupError for a used or invalid name, or an unknown role, topic or
  /// user.
  void add(const Wanted& wanted, const Validity& validity);
  /// Issues a new key, certificate and permissions. The old ones stay valid until they expire.
  void renew(const std::string& name, const Validity& validity);
  /// Revokes all certificates of this name, and updates the list in every identity folder here.
  /// Other hosts need the new list too; running processes read it at their next start.
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

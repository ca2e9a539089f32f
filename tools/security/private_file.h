// Writes files that have the correct mode from their first byte on.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

namespace perdure::tools {

struct Owner {
  uid_t user;
  gid_t group;
};
/// Looks up a user. Throws StartupError if the user does not exist.
Owner ownerNamed(const std::string& user);

/// Writes or replaces the file atomically. Throws StartupError if the disk reports an error.
void writePrivate(const std::filesystem::path& file, const std::string& text, mode_t mode,
                  const std::optional<Owner>& owner = {});
/// Creates a folder that only its owner can access.
void makePrivateFolder(const std::filesystem::path& folder, const std::optional<Owner>& owner = {});

}  // namespace perdure::tools

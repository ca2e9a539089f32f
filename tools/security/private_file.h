// Writes files with the correct mode from their first byte.
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
/// Throws StartupError if the user does not exist.
Owner ownerNamed(const std::string& user);

/// Replaces the file atomically, or throws StartupError.
void writePrivate(const std::filesystem::path& file, const std::string& text, mode_t mode,
                  const std::optional<Owner>& owner = {});
/// Creates a folder that only its owner can access.
void makePrivateFolder(const std::filesystem::path& folder, const std::optional<Owner>& owner = {});

}  // namespace perdure::tools

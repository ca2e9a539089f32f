// Files whose mode is right from their first byte.
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
/// Throws StartupError where there is no such user.
Owner ownerNamed(const std::string& user);

/// Replaces the file at once, or throws StartupError.
void writePrivate(const std::filesystem::path& file, const std::string& text, mode_t mode,
                  const std::optional<Owner>& owner = {});
/// For its owner alone.
void makePrivateFolder(const std::filesystem::path& folder, const std::optional<Owner>& owner = {});

}  // namespace perdure::tools

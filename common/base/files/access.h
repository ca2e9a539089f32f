// Permissions of files, for error messages.
#pragma once

#include <filesystem>
#include <string>

namespace perdure {

/// "PLACE may not be read by USER: permission denied; …" with owner, mode and the fix. The place is
/// the file, or the first of its folders that this process may not enter. Empty if it may read the
/// file, or if there is none.
std::string whyUnreadable(const std::filesystem::path& file);

/// Returns this text for a folder, or for the first entry in it, at any depth, that may not be
/// read.
std::string whyUnreadableIn(const std::filesystem::path& folder);

}  // namespace perdure

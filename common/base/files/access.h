// Content and permissions of files.
#pragma once

#include <filesystem>
#include <string>

namespace perdure {

/// The content of the file. Returns an empty string if the file cannot be read.
std::string textOf(const std::filesystem::path& file);

/// "PLACE may not be read by USER: permission denied; …" with owner, mode and the fix. The place is
/// the file, or the first of its folders that this process may not enter. Empty if it may read the
/// file, or if there is none.
std::string whyUnreadable(const std::filesystem::path& file);

/// Returns the same text for a folder, or for the first entry in it, at any depth, that may not be
/// read.
std::string whyUnreadableIn(const std::filesystem::path& folder);

}  // namespace perdure

// Content and permissions of files.
#pragma once

#include <filesystem>
#include <string>

namespace perdure {

/// The content of the file. Returns an empty string if the file cannot be read.
std::string textOf(const std::filesystem::path& file);

/// Returns "PLACE may not be read by USER: permission denied; …" with owner, mode and the fix.
/// PLACE is the file, or the first of its folders that this process may not enter. Returns an empty
/// string if the process may read the file, or if the file does not exist.
std::string whyUnreadable(const std::filesystem::path& file);

/// Returns the same text for a folder, or for the first entry at any depth in it that this process
/// may not read.
std::string whyUnreadableIn(const std::filesystem::path& folder);

}  // namespace perdure

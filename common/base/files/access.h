// Content and permissions of files.
#pragma once

#include <filesystem>
#include <string>

namespace perdure {

/// The content; empty if the file cannot be read.
std::string textOf(const std::filesystem::path& file);

/// Why this process may not read a file, with owner, mode and fix; empty if it may, or if it is
/// absent. The place is the file or the first of its folders that may not be entered.
std::string whyUnreadable(const std::filesystem::path& file);

/// The same for a folder, or for the first entry in it, at any depth, that may not be read.
std::string whyUnreadableIn(const std::filesystem::path& folder);

}  // namespace perdure

// Bytes as files, for readers that take a path; several files of a folder as one text.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace perdure::fuzz {

/// A folder of this process, made when first asked for and removed at the end; from then on also
/// that of its temporary files.
const std::filesystem::path& scratch();

/// The bytes as a file of that name in scratch().
std::filesystem::path asFile(const std::string& name, View bytes);

/// The files of a folder as one text, each after a line "=== its path".
Bytes pack(const std::filesystem::path& folder, const std::vector<std::string>& files);
/// The reverse. Only those of `files` are written, and those that the text lacks are removed.
void unpack(View bytes, const std::filesystem::path& folder, const std::vector<std::string>& files);

}  // namespace perdure::fuzz

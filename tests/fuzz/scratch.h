// Converts bytes to files, for readers that take a path, and several files of a folder to one text.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace perdure::fuzz {

/// Returns a folder of this process, made at the first call and removed at the end. TMPDIR then
/// names it, too.
const std::filesystem::path& scratch();

/// Writes the bytes to a file of that name in scratch() and returns its path.
std::filesystem::path asFile(const std::string& name, View bytes);

/// Joins the files of a folder into one text, each after a line "=== its path".
Bytes pack(const std::filesystem::path& folder, const std::vector<std::string>& files);
/// Splits such a text into files. Writes only those of `files`, and removes those that the text
/// lacks.
void unpack(View bytes, const std::filesystem::path& folder, const std::vector<std::string>& files);

}  // namespace perdure::fuzz

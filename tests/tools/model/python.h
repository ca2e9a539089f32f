// The generators of this folder, run by Debian's Python.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools::testing {

/// Whether Debian's Python has onnx: apt-get install python3-onnx.
bool pythonHasOnnx();

/// Runs `script` of this folder with an empty folder to write into, and returns that folder.
/// Throws std::runtime_error where it fails.
std::filesystem::path generated(const std::string& script);

}  // namespace perdure::tools::testing

// Runs the generators of this folder with Debian's Python.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::tools::testing {

/// Returns whether Debian's Python has onnx: apt-get install python3-onnx.
bool pythonHasOnnx();

/// Runs `script` of this folder with an empty folder as output, and returns that folder. Throws
/// std::runtime_error if it fails.
std::filesystem::path generated(const std::string& script);

}  // namespace perdure::tools::testing

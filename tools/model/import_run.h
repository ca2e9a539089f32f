// `perdure model import` as a whole: imported, compared, looked at, written.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

struct ImportOptions {
  std::filesystem::path network, out, image;  ///< out: a folder; empty: the network's
  double threshold = 0.25;
  bool unchecked = false;
  std::vector<std::string> arguments{};  ///< of the Python part
};

/// Prints what it finds. Throws StartupError, or CLI::RuntimeError with the status of the Python
/// part, which has said why; then nothing is written.
void importAndLook(const ImportOptions& options);

}  // namespace perdure::tools

// The complete `perdure model import`: import, comparison, test picture, output files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

struct ImportOptions {
  std::filesystem::path network, out, image;  ///< out: a folder; empty: the network's
  double threshold = 0.25;
  bool unchecked = false;
  std::vector<std::string> arguments{};  ///< options of the Python part
};

/// Prints the results. Throws StartupError, or CLI::RuntimeError with the status of the Python
/// part, which has reported the error. Then no file is written.
void importAndLook(const ImportOptions& options);

}  // namespace perdure::tools

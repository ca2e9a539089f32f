// The folder of the configuration files.
#pragma once

#include <filesystem>

namespace perdure::tools {

/// The configuration folder: $PERDURE_CONFIG_DIR, or else `config` in the working directory, or in
/// the source tree or installation above the program. Throws StartupError(kUnavailable) with the
/// fix if there is none.
std::filesystem::path configFolder();

}  // namespace perdure::tools

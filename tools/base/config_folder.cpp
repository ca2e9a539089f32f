#include "tools/base/config_folder.h"

#include <cstdlib>
#include <string>

#include "common/base/errors.h"

namespace perdure::tools {

namespace fs = std::filesystem;

fs::path configFolder() {
  const auto holds = [](const fs::path& folder) {
    std::error_code ignored;
    return fs::exists(folder / "class_aliases.yaml", ignored);
  };
  if (const char* given = std::getenv("PERDURE_CONFIG_DIR"); given != nullptr && *given != '\0') {
    if (holds(given)) return given;
    throw StartupError(ExitCode::kUnavailable,
                       "PERDURE_CONFIG_DIR=" + std::string(given) +
                           " holds no class_aliases.yaml; name Perdure's folder `config`");
  }
  if (holds("config")) return "config";
  std::error_code error;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up < 5 && folder.has_relative_path(); ++up, folder = folder.parent_path()) {
    for (const char* there : {"config", "share/perdure/config", "etc/perdure"}) {
      if (holds(folder / there)) return folder / there;
    }
  }
  throw StartupError(ExitCode::kUnavailable,
                     "the folder `config` with class_aliases.yaml is not found; name it in the "
                     "environment variable PERDURE_CONFIG_DIR");
}

}  // namespace perdure::tools

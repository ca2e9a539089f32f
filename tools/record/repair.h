// `perdure record repair`: completes unfinished recordings without losing a byte.
#pragma once

#include <filesystem>
#include <vector>

namespace perdure::tools {

/// Repairs files, or folders of files. If bytes are cut off, the original stays beside it as
/// FILE.before-repair. All files are processed before the failures are thrown as a StartupError.
void repairAll(const std::vector<std::filesystem::path>& paths);

}  // namespace perdure::tools

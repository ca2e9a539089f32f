// `perdure record repair`: recordings that were not finished are made whole, and no byte is lost.
#pragma once

#include <filesystem>
#include <vector>

namespace perdure::tools {

/// Files, or folders of them. Where bytes are cut off, the file as it was stays beside it as
/// FILE.before-repair. All are tried before what was refused is thrown as a StartupError.
void repairAll(const std::vector<std::filesystem::path>& paths);

}  // namespace perdure::tools

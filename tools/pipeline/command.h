// `perdure pipeline`: the services' nodes in one process, over a dataset folder.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addPipelineCommand(CLI::App& app);

}  // namespace perdure::tools

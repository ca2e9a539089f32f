// `perdure inference swap`: another network takes over while frames go on.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addInferenceCommand(CLI::App& app);

}  // namespace perdure::tools

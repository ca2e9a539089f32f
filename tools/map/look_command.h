// The command `perdure map look`.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addLookCommand(CLI::App& map);

}  // namespace perdure::tools

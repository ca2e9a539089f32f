// The command `perdure map correct`.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addCorrectCommand(CLI::App& map);

}  // namespace perdure::tools

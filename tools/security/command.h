// `perdure security`: identities for a bus that is closed to strangers.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addSecurityCommand(CLI::App& app);

}  // namespace perdure::tools

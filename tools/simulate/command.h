// `perdure simulate`: a rendered camera and IMU sequence with exact truth.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addSimulateCommand(CLI::App& app);

}  // namespace perdure::tools

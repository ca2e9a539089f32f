// `perdure calibrate`: the rig of a camera and an IMU from a recording of a board.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addCalibrateCommand(CLI::App& app);

}  // namespace perdure::tools

// `perdure calibrate`: the rig of a camera and an IMU from a recording of a board.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

/// Adds the subcommand `import`.
void addCalibrateImport(CLI::App& calibrate);
/// Adds the subcommand `from-motion`.
void addCalibrateFromMotion(CLI::App& calibrate);

}  // namespace perdure::tools

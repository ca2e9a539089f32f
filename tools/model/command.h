// `perdure model`: imports a user's network and shows its detections.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

/// Adds the subcommands `list` and `fetch`.
void addFetch(CLI::App& model);
/// Adds the subcommand `calibrate`.
void addCalibrate(CLI::App& model);

}  // namespace perdure::tools

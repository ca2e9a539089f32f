// `perdure model`: bring a network of one's own, and see what it sees.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

/// Its parts `list` and `fetch`.
void addFetch(CLI::App& model);
/// Its part `calibrate`.
void addCalibrate(CLI::App& model);

}  // namespace perdure::tools

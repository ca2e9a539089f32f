// `perdure detect`: writes the detections of a network on a dataset as a CSV for `--detections
// FILE`.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addDetectCommand(CLI::App& app);

}  // namespace perdure::tools

// `perdure detect`: a network's detections of a dataset as a CSV that `--detections FILE` reads.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addDetectCommand(CLI::App& app);

}  // namespace perdure::tools

// `perdure detect`: a network's detections of a dataset as a CSV that `--detections FILE` reads.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addDetectCommand(CLI::App& app);

}  // namespace perdure::tools

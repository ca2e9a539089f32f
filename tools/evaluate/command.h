// `perdure evaluate {objects,trajectory}`: the metrics of the design, section 7.
#pragma once

#include <CLI/CLI.hpp>

namespace perdure::tools {

void addEvaluateCommand(CLI::App& app);
void addEvaluateObjects(CLI::App& evaluate);
void addEvaluateTrajectory(CLI::App& evaluate);

}  // namespace perdure::tools

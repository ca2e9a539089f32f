// `perdure evaluate {objects,trajectory,consistency}`: the metrics of the design, section 7.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addEvaluateCommand(CLI::App& app);
void addEvaluateObjects(CLI::App& evaluate);
void addEvaluateTrajectory(CLI::App& evaluate);
void addEvaluateConsistency(CLI::App& evaluate);

}  // namespace perdure::tools

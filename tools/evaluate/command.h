// `perdure evaluate {objects,trajectory,consistency,memory}`: compares objects and trajectory with
// ground truth. Also judges whether covariances match the errors, and whether ids persist.
#pragma once

namespace CLI {
class App;
}

namespace perdure::tools {

void addEvaluateObjects(CLI::App& evaluate);
void addEvaluateTrajectory(CLI::App& evaluate);
void addEvaluateConsistency(CLI::App& evaluate);
void addEvaluateMemory(CLI::App& evaluate);

}  // namespace perdure::tools

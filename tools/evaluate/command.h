// `perdure evaluate {objects,trajectory,consistency,memory}`: objects and trajectory against the
// truth, whether their covariances are as large as their errors, and whether ids last.
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

// `perdure evaluate {objects,trajectory,consistency}`: objects and trajectory against the truth,
// and whether their covariances are as large as their errors.
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

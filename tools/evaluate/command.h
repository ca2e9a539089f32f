// `perdure evaluate {objects,trajectory,consistency,memory}`: comparison with ground truth.
#pragma once

#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace perdure::tools {

void addEvaluateObjects(CLI::App& evaluate);
void addEvaluateTrajectory(CLI::App& evaluate);
void addEvaluateConsistency(CLI::App& evaluate);
void addEvaluateMemory(CLI::App& evaluate);

/// Scores a run against true poses and prints the result. Returns false if --places is not given.
using PlacesJudge =
    std::function<bool(const std::string& run, const std::string& truth, bool as_json)>;
/// Adds --places, and the options that require it, to the subcommand `memory`.
PlacesJudge addPlacesOptions(CLI::App& memory);

}  // namespace perdure::tools

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

/// Judges a run by true poses and prints the result; returns false if --places is not given.
using PlacesJudge =
    std::function<bool(const std::string& run, const std::string& truth, bool as_json)>;
/// Adds --places to `memory`, and the options that need it.
PlacesJudge addPlacesOptions(CLI::App& memory);

}  // namespace perdure::tools

// Draws the scores of the filter's beliefs.
#pragma once

#include <filesystem>

#include "tests/scenario/beliefs/trial.h"

namespace perdure::test {

/// Writes a PNG with reliability diagrams of existence and of the most probable class, with sample
/// counts. It also shows the normalised squared errors against the χ² distribution of consistent
/// errors.
void drawBeliefs(const BeliefScores& scores, const std::filesystem::path& file);

}  // namespace perdure::test

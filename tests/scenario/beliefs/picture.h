// What the scores of the filter's beliefs look like, for people.
#pragma once

#include <filesystem>

#include "tests/scenario/beliefs/trial.h"

namespace perdure::test {

/// A PNG: reliability diagrams of existence and of the most probable class, with how many were
/// asked; and how the normalised squared errors lie beside the χ² distribution of honest ones.
void drawBeliefs(const BeliefScores& scores, const std::filesystem::path& file);

}  // namespace perdure::test

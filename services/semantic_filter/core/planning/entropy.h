// Entropies and their expected fall by an observation, in bits. Derivation:
// tools/docs/maths/expected_information.md.
#pragma once

#include <vector>

namespace perdure::semantic_filter {

/// Returns the entropy of an event of probability `p`.
double entropyOf(double p);

/// Returns the expected fall of the entropy of "it exists", of probability `r`. `missed`:
/// probability that it is not detected although it exists.
double existenceFall(double r, double missed);

/// Returns the expected fall of the entropy of the class by class evidence of `nats`: the mean
/// log-likelihood ratio of the true class to any other. `pmf` sums to 1.
double classFall(const std::vector<double>& pmf, double nats);

}  // namespace perdure::semantic_filter

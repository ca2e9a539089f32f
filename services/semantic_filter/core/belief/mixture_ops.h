// Operations on the mixture of one track: weights, PMF, moment matching (Bar-Shalom, Li 2001, eq.
// 1.4.16) and distances. Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include <string>

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// Returns π of a class: the sum of the weights of its hypotheses.
double classProbability(const Track& track, const std::string& class_name);
/// Whether all numbers are finite and the sum of the weights is positive.
bool sound(const Track& track);
/// Returns π of each class, in the order of the first hypothesis of each. The sum is 1.
ClassNumbers classShares(const Track& track);
/// Enters the present PMF in the ledger, whatever the sum of the weights.
void book(Track& track, ClassEvidence why);
/// Divides the weights by their sum, sorts them (heaviest first) and enters the PMF in the ledger.
void normalise(Track& track, ClassEvidence why);
/// Returns a - b of the cuboids, with yaw modulo 180°, because a turned cuboid is the same.
Vector7d geometryDifference(const Hypothesis& a, const Hypothesis& b);
/// Merges b into a: adds the weights and keeps mean and covariance of the pair, yaw modulo 180°.
void mergeInto(Hypothesis& a, const Hypothesis& b);

/// Returns the squared Mahalanobis distance of b from a, by the covariance of a. It compares the
/// geometry (yaw modulo 180°) and, if a moves, the velocity.
double distance2(const Hypothesis& a, const Hypothesis& b);

/// Whether the size of `h` differs from that of the class by `size_gate` deviations or more.
bool misshapen(const Hypothesis& h, const ClassPrior& prior, double size_gate);

}  // namespace perdure::semantic_filter

// Operations on the mixture of one track: weights, PMF, moment matching, distances.
#pragma once

#include <string>
#include <vector>

#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// π of a class: the sum of its hypotheses' weights.
double classProbability(const Track& track, const std::string& class_name);
/// All numbers are finite and some weight is left.
bool sound(const Track& track);
/// π of each class, in the order of its heaviest hypothesis.
std::vector<ClassNumber> classShares(const Track& track);
/// Books the weights as they are now, whatever their sum.
void book(Track& track, ClassEvidence why);
/// Divides the weights by their sum, puts the heaviest first (stable), and books them.
void normalise(Track& track, ClassEvidence why);
/// a - b of the cuboids, yaw modulo 180°: a cuboid is the same turned by that.
Vector7d geometryDifference(const Hypothesis& a, const Hypothesis& b);
/// x ⊕ of a moment-matched pair: b is merged into a, weights added; yaw differences are wrapped.
void mergeInto(Hypothesis& a, const Hypothesis& b);

/// Squared Mahalanobis distance of b from a by a's covariance: geometry, yaw modulo 180°, and the
/// velocity where a moves.
double distance2(const Hypothesis& a, const Hypothesis& b);

/// Whether its size is `size_gate` deviations of the class's from that of the class, or further.
bool misshapen(const Hypothesis& h, const ClassPrior& prior, double size_gate);

}  // namespace perdure::semantic_filter

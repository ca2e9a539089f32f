// Tend: prune, confirm, die (paper, "Termination"; DESIGN 5, items 11 and 12). What two objects
// that are one become: merge.h.
#pragma once

#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Merges and prunes an object's hypotheses: near ones of the same class and motion become one,
/// light ones go, so do those that no longer have the size of their class, a dominant class ends
/// the others, a moving one that stands still is static, and a static object that its boxes
/// contradict gets a moving twin and one that is misplaced along the ray. Nothing may be left.
void tendHypotheses(Object& object, const ClassPriors& priors, const Parameters& parameters);

/// One at rest as it may just be driving off.
Hypothesis drivingOff(Hypothesis at_rest);

/// Squared Mahalanobis distance of b from a by a's covariance: geometry, yaw modulo 180°, and the
/// velocity where a moves.
double distance2(const Hypothesis& a, const Hypothesis& b);

/// Whether its size is `size_gate` deviations of the class's from that of the class, or further.
bool misshapen(const Hypothesis& h, const ClassPrior& prior, double size_gate);

/// The most that is believed of its existence.
double certainty(const Object& object, const TendParameters& parameters);

/// Standard deviation of the place relative to the body, metres: what the pose error does not
/// share.
double placeSigma(const Hypothesis& h, const Matrix6d& P_pose);
/// The same of an object: of its hypotheses, and by how far they are from each other.
double placeSigma(const Object& object, const Matrix6d& P_pose);
/// Whether it surely exists and its best hypothesis knows its place. A claim asks all of them for
/// the place; to be a thing that was known before, its being there is enough.
bool established(const Object& object, const FrameContext& frame);
/// Confirms what surely exists at a known place, takes that back where it is lost, and removes
/// those whose existence has gone, which it returns.
std::vector<Object> confirmAndBury(std::vector<Object>& objects, const FrameContext& frame);

}  // namespace perdure::semantic_filter

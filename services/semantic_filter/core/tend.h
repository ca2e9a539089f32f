// Tend: merge, prune, confirm, die (paper, "Merge" and "Termination"; DESIGN 5, items 11 and 12).
#pragma once

#include <vector>

#include "services/semantic_filter/core/look.h"

namespace perdure::semantic_filter {

struct MergeRecord {
  ObjectId survivor = 0, absorbed = 0;
};

/// Merges and prunes an object's hypotheses: near ones of the same class and motion become one,
/// light ones go, so do those that no longer have the size of their class, a dominant class ends
/// the others, a moving one that stands still is static, and a static object that its boxes
/// contradict gets a moving twin and one that is misplaced along the ray. Nothing may be left.
void tendHypotheses(Object& object, const ClassPriors& priors, const Parameters& parameters);

/// Squared Mahalanobis distance of b from a by a's covariance: geometry, yaw modulo 180°, and the
/// velocity where a moves.
double distance2(const Hypothesis& a, const Hypothesis& b);

/// Shared volume over joint volume of two upright cuboids.
double overlap(const State& a, const State& b, const Eigen::Vector3d& up_W);

/// Merges objects of the same best class that occupy the same space; the older survives. Both are
/// seen, or one hides the other; the rest waits: a frame that does not see them does not change
/// them.
std::vector<MergeRecord> mergeObjects(std::vector<Object>& objects, const FrameContext& frame);

/// The state of two beliefs about one object whose errors are independent but for the size prior
/// and the pose error, both of which are counted once.
Hypothesis fuse(const Hypothesis& a, const Hypothesis& b, const ClassPrior& prior,
                const Matrix6d& P_pose);

/// Standard deviation of the place relative to the body, metres: what the pose error does not
/// share.
double placeSigma(const Hypothesis& h, const Matrix6d& P_pose);
/// Confirms what surely exists at a known place, takes that back where it is lost, and removes
/// those whose existence has gone.
void confirmAndBury(std::vector<Object>& objects, const FrameContext& frame);

}  // namespace perdure::semantic_filter

// Two tracks that are one (paper, "Merge"; DESIGN 5, item 12): which are, and what is then known.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct MergeRecord {
  ObjectId survivor = 0, absorbed = 0;
  bool moved = false;     ///< the one was found again as the other, elsewhere (core/moved.h)
  bool returned = false;  ///< the one was believed gone, and is found again as the other
};

/// Shared volume over joint volume of two upright cuboids.
double overlap(const State& a, const State& b, const Eigen::Vector3d& up_W);

/// Merges tracks of the same best class that occupy the same space; the older survives. Both are
/// seen, or one hides the other; the rest waits: a frame that does not see them does not change
/// them.
std::vector<MergeRecord> mergeObjects(std::vector<Track>& tracks, const FrameContext& frame);

/// Neither class nor motion forbids that they are one.
bool sameKind(const Track& a, const Track& b);

/// Takes b, which is the same track, into a.
void mergeTwo(Track& a, Track& b, const FrameContext& frame);

/// The state of two beliefs about one track whose errors are independent but for the size prior
/// and the pose error, both of which are counted once.
Hypothesis fuse(const Hypothesis& a, const Hypothesis& b, const ClassPrior& prior,
                const Matrix6d& P_pose);

}  // namespace perdure::semantic_filter

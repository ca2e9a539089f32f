// Merge: decides which tracks are one object, and fuses them (paper, "Merge", line 286).
// Derivation: tools/docs/maths/merge_and_fusion.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct MergeRecord {
  TrackId survivor = 0, absorbed = 0;
  bool moved = false;  ///< re-identified: the object was moved or drove off (tracks/reidentify.h)
  bool returned = false;  ///< re-identified: the survivor had been deleted
  bool by_map = false;    ///< the map reports both as one object
};

/// Returns the shared volume over the joint volume of two upright cuboids. `up_W`: against gravity.
double overlap(const State& a, const State& b, const Eigen::Vector3d& up_W);

/// Merges tracks of one kind in the same space. The confirmed one survives, or else the older one.
/// A pair can merge if both are visible, one occludes the other, or one comes from the map.
std::vector<MergeRecord> mergeObjects(std::vector<Track>& tracks, const FrameContext& frame);

/// Whether two tracks of one kind share a part of their space, and no frame detected both. One may
/// then be the part of the other that was visible earlier.
bool mayBeOne(const Track& a, const Track& b, const FrameContext& frame);

/// Whether class and motion allow that both are one object.
bool sameKind(const Track& a, const Track& b);

/// Merges track b into a. Both must be of one object.
void mergeTwo(Track& a, Track& b, const FrameContext& frame);

/// Fuses two beliefs about one object. Their errors are independent, except for the size prior and
/// the pose error (`P_pose`); each of these counts once.
Hypothesis fuse(const Hypothesis& a, const Hypothesis& b, const ClassPrior& prior,
                const Matrix6d& P_pose);

}  // namespace perdure::semantic_filter

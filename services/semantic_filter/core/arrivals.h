// Arrivals: tracks that the map gives to the working set, and tracks that the map merges. They are
// an input of a frame, so a repeated step uses them again. Derivation of their covariances:
// tools/docs/maths/pose_error.md.
#pragma once

#include <map>
#include <vector>

#include "common/types/map.h"
#include "services/semantic_filter/core/filter.h"

namespace perdure::semantic_filter {

struct Arrivals {
  /// Objects that are placed relative to the body. Their C = A P_g follows from the pose error of
  /// the frame.
  std::vector<ObjectBelief> placed;
  /// A belief as this process published it, with the product of transitions of that time.
  struct Published {
    ObjectBelief belief;
    Matrix6d product = Matrix6d::Identity();
  };
  std::vector<Published> as_published;
  std::map<TrackId, ObjectId> members;  ///< object of each track, if its id is another
  ExistenceEvidence evidence = ExistenceEvidence::kRecall;

  ObjectId objectOf(TrackId track) const;
};

/// Adds arrivals to the belief before a frame. A track that was detected since its recall stays
/// unchanged. Two tracks of one object are fused; the one that was detected on this visit remains.
/// If their classes exclude each other, a track that was not detected is removed. Returns the
/// merges.
std::vector<MergeRecord> takeIn(const Arrivals& arrivals, Belief& belief, const FrameInput& input,
                                const SemanticFilter& filter);

}  // namespace perdure::semantic_filter

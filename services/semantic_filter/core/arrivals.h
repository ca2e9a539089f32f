// Arrivals: tracks that the map gives to the working set, and tracks that the map merges. They are
// an input of a frame, so a repeated step takes them again. Derivation of their covariances:
// tools/docs/maths/pose_error.md.
#pragma once

#include <map>
#include <vector>

#include "common/types/map.h"
#include "services/semantic_filter/core/filter.h"

namespace perdure::semantic_filter {

struct Arrivals {
  /// Placed relative to the body: C = A P_g follows from the pose error of the frame.
  std::vector<ObjectBelief> placed;
  /// A belief as this process published it, with the product of transitions of that time.
  struct Published {
    ObjectBelief belief;
    Matrix6d product = Matrix6d::Identity();
  };
  std::vector<Published> as_published;
  std::map<TrackId, ObjectId> members;  ///< objects of the tracks that have another id
  ExistenceEvidence evidence = ExistenceEvidence::kRecall;

  ObjectId objectOf(TrackId track) const;
};

/// Takes arrivals into the belief before a frame. A track that was detected since stays unchanged.
/// Two tracks of one object are fused; the track that was detected on this visit survives. If their
/// classes exclude each other, the track that was not detected leaves. Returns the fused tracks.
std::vector<MergeRecord> takeIn(const Arrivals& arrivals, Belief& belief, const FrameInput& input,
                                const SemanticFilter& filter);

}  // namespace perdure::semantic_filter

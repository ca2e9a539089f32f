// One step of the filter (paper, eq. 4, 8, 9). Late detections repeat steps (core/history.h).
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

struct StepReport {
  std::vector<MergeRecord> merges;
  std::size_t broken = 0;  ///< tracks that were dropped because their numbers became invalid
};

class SemanticFilter {
 public:
  SemanticFilter(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters), priors_(priors) {}

  /// Replaces the belief before a frame by the belief after it.
  StepReport step(Belief& belief, const FrameInput& heard, IdBook& ids) const;
  /// Fuses two tracks of one object. The result has the mixture of the older one, and the id `id`.
  /// Returns false and does nothing if their classes exclude each other. Both tracks must exist.
  bool join(Belief& belief, TrackId id, TrackId absorbed, const FrameInput& input) const;

 private:
  Parameters parameters_;
  ClassPriors priors_;
};

}  // namespace perdure::semantic_filter

// The semantic filter in six verbs: predict, see, associate, update, smooth, tend (eq. 4, 8, 9).
//
// The belief is a plain value and a step is a function of (belief, frame): a late frame is applied
// by taking the belief before it and stepping again (DESIGN 5, item 14).
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/memory/drift.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

struct StepReport {
  std::vector<DriftMeasurement> drift;  ///< of things that came back from an earlier visit
  std::vector<MergeRecord> merges;
  std::size_t broken = 0;  ///< tracks whose numbers went bad, and which were dropped
};

class SemanticFilter {
 public:
  SemanticFilter(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters), priors_(priors) {}

  /// Makes `belief`, a copy of that `before` the frame, the one after it.
  StepReport step(const Belief& before, Belief& belief, const FrameInput& heard, IdBook& ids) const;
  /// Of two tracks that are known to be one, `id` goes on with what both knew, as of that frame.
  /// Nothing happens where one of them is not there, or their classes exclude each other.
  std::optional<MergeRecord> join(Belief& belief, ObjectId id, ObjectId absorbed,
                                  const FrameInput& input) const;

  const Parameters& parameters() const { return parameters_; }
  const ClassPriors& priors() const { return priors_; }

 private:
  struct ScoredTrack {
    std::size_t track;
    TrackScore score;
    std::optional<std::size_t> assigned = {};    ///< the box that is surely its own
    bool near_box = false;                       ///< at rest, and a box lies near
    std::optional<DriftMeasurement> drift = {};  ///< until the look is taken back
  };

  NoiseScale noiseScaleOf(const Belief& belief, const FrameInput& input) const;
  FrameContext contextOf(const Belief& belief, const FrameInput& input) const;
  /// Visibility of all tracks, published with them; one TrackVisibility for each.
  std::vector<TrackVisibility> updateVisibility(Belief& belief, const FrameInput& input) const;
  std::vector<ScoredTrack> scoreAll(Belief& belief,
                                    const std::vector<TrackVisibility>& visibilities,
                                    const FrameInput& input, const FrameContext& frame) const;
  /// Updates what is scored; returns for each box how much of it is explained.
  Eigen::VectorXd associateAndUpdate(Belief& belief, std::vector<ScoredTrack>& scored,
                                     const FrameInput& input, const FrameContext& frame) const;
  /// Whether a look at it will tell of the pose: once for each time that it comes back.
  bool measuresDrift(const Track& track, const FrameContext& frame) const;
  /// One as it was scored, until its look was heard: from `was`, as it was before the frame, and
  /// `now`, as it is.
  Track asScored(const Track& was, const Track& now, const ScoredTrack& scored,
                 const FrameInput& input, const FrameContext& frame) const;
  /// Of one track after its look; nothing may be left of it.
  void manage(Track& track, const Track& was, ScoredTrack& scored, const FrameInput& input,
              const FrameContext& frame) const;

  Parameters parameters_;
  ClassPriors priors_;
};

}  // namespace perdure::semantic_filter

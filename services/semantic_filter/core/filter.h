// One step of the semantic filter: from the belief before a frame and the frame to the belief after
// it (eq. 4, 8, 9). The belief is a plain value, so that a late frame is applied by taking the
// belief before it and stepping again (core/history.h).
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

struct StepReport {
  std::vector<MergeRecord> merges;
  std::size_t broken = 0;  ///< tracks whose numbers went bad, and which were dropped
};

class SemanticFilter {
 public:
  SemanticFilter(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters), priors_(priors) {}

  /// Makes the belief before a frame the one after it.
  StepReport step(Belief& belief, const FrameInput& heard, IdBook& ids) const;
  /// Fuses two tracks of one object as of that frame; `id` goes on. Returns false and does nothing
  /// if their classes exclude each other. Both must exist.
  bool join(Belief& belief, TrackId id, TrackId absorbed, const FrameInput& input) const;

  const Parameters& parameters() const { return parameters_; }
  const ClassPriors& priors() const { return priors_; }

 private:
  struct ScoredTrack {
    std::size_t track;  ///< index in Belief::tracks
    TrackScore score;
    std::optional<std::size_t> assigned = {};  ///< box of the frame
    /// The track before its update, if it was confirmed, is static, and a box is near: one bad box
    /// must not deform it.
    std::optional<Track> before = {};
    bool sound = true;  ///< after its update
  };

  NoiseScale noiseScaleOf(const Belief& belief, const FrameInput& input) const;
  /// The input with boxes whose noise is as it was learned for their network.
  FrameInput withLearnedNoise(const Belief& belief, FrameInput input) const;
  FrameContext contextOf(const Belief& belief, const FrameInput& input) const;
  /// Sets the visibility of all tracks; returns it, one for each.
  ScratchVector<TrackVisibility> updateVisibility(Belief& belief, const FrameInput& input) const;
  /// Predicts and scores the visible tracks.
  ScratchVector<ScoredTrack> scoreAll(Belief& belief,
                                      const ScratchVector<TrackVisibility>& visibilities,
                                      const FrameInput& input, const FrameContext& frame) const;
  /// Updates the scored tracks; returns Association::explained.
  Eigen::VectorXd associateAndUpdate(Belief& belief, ScratchVector<ScoredTrack>& scored,
                                     const FrameInput& input, const FrameContext& frame) const;
  void manageAll(Belief& belief, ScratchVector<ScoredTrack>& scored, const FrameInput& input,
                 const FrameContext& frame) const;
  /// Reduces the mixture of one track after its update. Where nothing is left of it, the box counts
  /// as a miss, or the state begins anew from the box; otherwise existence is 0.
  void manage(Track& track, ScoredTrack& scored, const FrameInput& input,
              const FrameContext& frame) const;
  static void dropBroken(Belief& belief, StepReport& report);
  static void recordDetections(Belief& belief, TimePoint now);
  /// Merges, confirms, deletes and re-identifies tracks.
  void resolveIdentities(Belief& belief, const FrameContext& frame, TimePoint now,
                         StepReport& report) const;

  Parameters parameters_;
  ClassPriors priors_;
};

}  // namespace perdure::semantic_filter

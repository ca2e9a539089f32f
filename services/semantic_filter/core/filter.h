// One step of the semantic filter: computes the belief after a frame from the belief before it and
// the frame (eq. 4, 8, 9). The belief is a plain value. A late frame is applied by repeating the
// steps from the belief before it (core/history.h).
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
  std::size_t broken = 0;  ///< tracks that were dropped because their numbers became invalid
};

class SemanticFilter {
 public:
  SemanticFilter(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters), priors_(priors) {}

  /// Replaces the belief before a frame by the belief after it.
  StepReport step(Belief& belief, const FrameInput& heard, IdBook& ids) const;
  /// Fuses two tracks of one object as of that frame. The older track gives the mixture, because
  /// more is known of it; `id` names the result. Returns false and does nothing if their classes
  /// exclude each other. Both must exist.
  bool join(Belief& belief, TrackId id, TrackId absorbed, const FrameInput& input) const;

  const Parameters& parameters() const { return parameters_; }
  const ClassPriors& priors() const { return priors_; }

 private:
  struct ScoredTrack {
    std::size_t track;  ///< index in Belief::tracks
    TrackScore score;
    std::optional<std::size_t> assigned = {};  ///< the box of the frame that is assigned to the
                                               ///< track
    /// The track before its update, if it was confirmed, is static, and a box is near. One bad box
    /// must not deform the track.
    std::optional<Track> before = {};
    bool sound = true;  ///< state of its numbers after the update
  };

  NoiseScale noiseScaleOf(const Belief& belief, const FrameInput& input) const;
  /// Returns the input with the learned noise of the network in its boxes.
  FrameInput withLearnedNoise(const Belief& belief, FrameInput input) const;
  FrameContext contextOf(const Belief& belief, const FrameInput& input) const;
  /// Sets the visibility of all tracks and returns it in the order of the tracks.
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
  /// Reduces the mixture of one track after its update. If no hypothesis remains, the box counts as
  /// a miss, or the box re-initialises the state; otherwise existence becomes 0.
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

// Measurement likelihood of a box (paper, eq. 7) given the best hypothesis of each track.
// Derivation: tools/docs/maths/measurement_likelihood.md.
#pragma once

#include <array>
#include <optional>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/belief/belief.h"

namespace perdure::semantic_filter {

/// The predicted measurements of one frame, one for each track, computed when first needed. Belief,
/// input and parameters must outlive this object.
class BoxExplanations {
 public:
  BoxExplanations(const Belief& belief, const FrameInput& input, const Parameters& parameters);

  /// Returns the log-likelihood ratio of the box (sides and class) to clutter given the track with
  /// index j, in nats. Returns nothing if the box is outside the gate or the object is not in front
  /// of the camera. `hidden`: sides that a nearer object hides.
  std::optional<double> fit(std::size_t j, const std::array<bool, 4>& hidden,
                            const BoxDetection& box);

 private:
  const Belief& belief_;
  const FrameInput& input_;
  Projector from_;
  Judge judge_;
  ScratchVector<std::optional<std::optional<PredictedBox>>> at_;  ///< outer empty: not computed
};

/// Adds the partial views of tracks with v = 0 to the clutter of each box (log_partial_views). The
/// box then supports a new or another track less. The tracks do not change.
void explainPartialViews(const Belief& belief, const ScratchVector<TrackVisibility>& visibilities,
                         FrameInput& input, const Parameters& parameters,
                         const ClassPriors& priors);

/// If an occluded track explains a box far better than any visible one, the occluder was misjudged.
/// The occluded track gets v = visibility.minimum in this frame.
void reviseOcclusion(Belief& belief, ScratchVector<TrackVisibility>& visibilities,
                     const FrameInput& input, const Parameters& parameters);

}  // namespace perdure::semantic_filter

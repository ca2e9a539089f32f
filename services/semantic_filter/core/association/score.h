// Score: how each hypothesis of an track explains each box (eq. 7 at b = π(g s)), and how much a
// score is worth beside earlier looks from the same place (DESIGN 5, items 5 and 7).
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// How a hypothesis explains one box.
struct BoxMatch {
  double likelihood = 0.0;  ///< L(z), 0 outside the gate
  double nis = 0.0;         ///< per degree of freedom, where likelihood > 0
  int part = -1;            ///< BoxScore::part
};

/// One hypothesis in one frame.
struct HypothesisScore {
  std::optional<ProjectedBox> box;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of the predicted sides, without R
  double detection_probability = 0.0;  ///< v P_D: probability that the network reports it
  double undetected = 0.0;             ///< v (1 - P_D): that it is in visibility and not reported
  double no_box = 1.0;            ///< A without a box: 1 - v P_D, and what a primed answer says
  std::vector<BoxMatch> matches;  ///< for each box of the score
  double expected = 0.0;          ///< v P_D of its class, whatever is known of the track itself
  double correlated_observations = 0.0;  ///< earlier looks that share this view, if it is true
};

struct TrackScore {
  TrackVisibility visibility;
  bool top_down = false;           ///< the network was asked about it (core/primed.h)
  std::vector<std::size_t> boxes;  ///< of the frame, those that lie near one of the hypotheses
  std::vector<HypothesisScore> hypotheses;
};

/// log of the density of clutter, of the sides that were compared: one of fewer is of other units.
double logClutterOf(const BoxDetection& e, const BoxScore& score, const View& view,
                    const ClutterParameters& parameters);

TrackScore scoreTrack(const Track& track, const TrackVisibility& visibility,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame);

/// The sides of one of the frame's boxes that something hides: by the hypothesis that explains it
/// best.
std::array<bool, 4> hiddenSides(const TrackScore& score, std::size_t box);

/// "Object made this box of the look" against "object made none, or is not there".
double associationWeight(const Track& track, const TrackScore& score, std::size_t box);

}  // namespace perdure::semantic_filter

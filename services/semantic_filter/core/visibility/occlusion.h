// See: which tracks the camera can see now, by a coarse depth buffer of cuboids painted nearest
// first (DESIGN 5, item 3; the paper's π that must take occlusions into account, line 182).
#pragma once

#include <array>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// One track as the depth buffer wants it.
struct Outline {
  ObjectId id = 0;
  double solidity = 0.0;       ///< probability that it is there and hides what is behind it
  double distance_m = 0.0;     ///< from the camera to the centre
  double depth_sigma_m = 0.0;  ///< standard deviation of that distance
  double extent_m = 0.0;       ///< half of the cuboid's largest side
  std::optional<ProjectedOutline> box;
};

struct TrackVisibility {
  Visibility state = Visibility::kBehind;
  double fraction = 0.0;  ///< v; exactly 0 where a frame says nothing about the track
  double residual_fraction =
      0.0;  ///< what is to be seen of one whose v is 0, less than visibility.minimum
  ObjectId blocked_by = 0;
  std::array<bool, 4> hidden_sides{};  ///< sides (x1, y1, x2, y2) that lie behind a nearer track
};

/// Of the track in its cuboid `x`, as it is seen `from` there.
Outline outlineOf(const Track& track, const State& x, const Projector& from,
                  const Shape& shape = cuboidShape());

/// TrackVisibility::fraction of the first outline as `see` gives it, without landmarks and for any
/// minimum: what nothing nearer hides of it.
double shareOfFirst(const std::vector<Outline>& outlines, double width, double height,
                    const VisibilityParameters& parameters);

/// One TrackVisibility for each outline, in the same order; `width`, `height` of the image in
/// pixels.
std::vector<TrackVisibility> computeVisibility(const std::vector<Outline>& outlines,
                                               const std::vector<LandmarkDepth>& points,
                                               double width, double height,
                                               const VisibilityParameters& parameters);

}  // namespace perdure::semantic_filter

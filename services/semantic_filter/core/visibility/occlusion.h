// Visible fraction of each track, from a coarse depth buffer of outlines, nearest first (paper,
// line 182). Derivation: tools/docs/maths/visibility.md.
#pragma once

#include <array>
#include <vector>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct Outline {
  ObjectId id = 0;
  double solidity = 0.0;       ///< probability that the object exists and hides others
  double distance_m = 0.0;     ///< from the camera to the centre
  double depth_sigma_m = 0.0;  ///< standard deviation of that distance
  double extent_m = 0.0;       ///< half of the cuboid's largest side
  std::optional<ProjectedOutline> box;
};

struct TrackVisibility {
  Visibility state = Visibility::kBehind;
  double fraction = 0.0;  ///< v; exactly 0 if a frame does not change the track
  double residual_fraction =
      0.0;  ///< visible fraction of a track whose v is 0; below visibility.minimum
  ObjectId blocked_by = 0;
  std::array<bool, 4> hidden_sides{};  ///< sides (x1, y1, x2, y2) that a nearer object hides
};

Outline outlineOf(const Track& track, const State& x, const Projector& from,
                  const Shape& shape = cuboidShape());

/// Returns the visible fraction of the first outline, without landmarks and without a minimum.
double shareOfFirst(const ScratchVector<Outline>& outlines, const CameraModel& camera,
                    const VisibilityParameters& parameters);

/// Returns the visibility of each outline, in the same order.
ScratchVector<TrackVisibility> computeVisibility(const ScratchVector<Outline>& outlines,
                                                 const std::vector<LandmarkDepth>& points,
                                                 const CameraModel& camera,
                                                 const VisibilityParameters& parameters);

}  // namespace perdure::semantic_filter

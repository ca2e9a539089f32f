// The parameters of all rooms. Each room owns its own; config.cpp says which of them can be set.
#pragma once

#include "services/semantic_filter/core/association/parameters.h"
#include "services/semantic_filter/core/belief/parameters.h"
#include "services/semantic_filter/core/measurement/parameters.h"
#include "services/semantic_filter/core/memory/parameters.h"
#include "services/semantic_filter/core/smoothing/parameters.h"
#include "services/semantic_filter/core/tracks/parameters.h"
#include "services/semantic_filter/core/visibility/parameters.h"

namespace perdure::semantic_filter {

struct Parameters {
  BoxParameters box;
  ClutterParameters clutter;
  InitiationParameters initiation;
  MotionParameters motion;
  PoseParameters pose;
  TemperingParameters tempering;
  VisibilityParameters visibility;
  TrackParameters tracks;
  SmoothingParameters smoothing;
  GroundParameters ground;
  MemoryParameters memory;
};

}  // namespace perdure::semantic_filter

/// Gates: squared Mahalanobis distances beyond which two things are not what they are compared as.
/// In brackets: dimensions, and the probability that a Gaussian residual is beyond. The gate of a
/// box is box.gate, that of two hypotheses tracks.hypothesis_merge.
namespace perdure::semantic_filter::gates {

// A box and a hypothesis.
inline constexpr double kWholeView = 9.0;       ///< [4, .06] beyond, a partial view is tried
inline constexpr double kForeignBox = 14.0;     ///< [4, .007] the keyframe showed something else
inline constexpr double kContradiction = 25.0;  ///< [4, 5e-5] the keyframe contradicts a MAP fit

// Two boxes of one image.
inline constexpr double kSameEdge = 4.0;  ///< [1, .05] their sides are not the same edge
inline constexpr double kLower = 4.0;     ///< [1, .05] one reaches lower than the other

// Two Gaussians.
inline constexpr double kNoFusion = 24.3;  ///< [7, .001] the mean of both would be wrong
inline constexpr double kSameMode = 1.0;   ///< [7, .995] two modes of one track are one
inline constexpr double kSameFit = 0.25;   ///< [7] a fit comes to a mode that is known
inline constexpr double kUnchanged = 1.0;  ///< [7, .995] a refit changed little

// One height.
inline constexpr double kGroundOutlier = 12.0;  ///< [1, .0005] it does not stand on this ground

}  // namespace perdure::semantic_filter::gates

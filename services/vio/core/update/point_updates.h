// Updates with points used once (Mourikis & Roumeliotis, ICRA 2007), and with points of the state:
// these are initialised late and updated by the newest image (Li & Mourikis, RSS 2012).
#pragma once

#include <vector>

#include "common/base/result.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct UpdateCounts {
  int used = 0, gated = 0;
  int supposed = 0;     ///< number of used points with the scene's depth
  int behind = 0;       ///< points whose rays do not meet in front of the cameras
  bool jumped = false;  ///< most points failed at once by a wide margin
};

/// Triangulates and gates each track, counts failures in `reasons`, and updates the state once with
/// all tracks. Fails if State::update() fails.
Result<UpdateCounts> updateMsckf(State& state, const std::vector<const Track*>& tracks,
                                 const VisionOptions& options, ReasonCounts& reasons);

struct Innovation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();     ///< pixel in the first camera
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();  ///< observed minus predicted, px
  double nis = 0.0;                                    ///< rᵀ S⁻¹ r over all its views
  int rows = 0;                                        ///< degrees of freedom of nis
  bool used = false;                                   ///< passed the gate
};

/// Updates the state's points with their observations in the newest clone. A point leaves the state
/// if it fails the gate three times in a row or lies behind the camera. `innovations`, if given, is
/// filled. If most points fail at once by a wide margin and `may_jump`, the pose covariance is
/// enlarged by `VisionOptions::jump_*`, the gates are repeated, and "images_jumped" is counted.
Result<UpdateCounts> updateSlam(State& state, const FeatureDatabase& database,
                                const VisionOptions& options, bool may_jump, ReasonCounts& reasons,
                                std::vector<Innovation>* innovations = nullptr);

/// Adds the point of the track to the state, using all views. Fails as triangulate() and
/// State::update() do, or with "slam_few_views", "slam_depth_unknown", "slam_unobserved" or
/// "slam_gated".
Result<void> initialisePoint(State& state, const Track& track, const VisionOptions& options);

}  // namespace perdure::vio

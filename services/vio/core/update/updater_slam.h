// Points that live in the state: their delayed initialisation from a full track, and their update
// with the newest image (Li & Mourikis, RSS 2012: hybrid MSCKF / EKF-SLAM).
#pragma once

#include "services/vio/core/update/updater_msckf.h"

namespace perdure::vio {

/// What the newest image says of a point of the state against what was predicted.
struct Innovation {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();     ///< as seen by the first camera
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();  ///< seen less predicted there, px
  double nis = 0.0;                                    ///< rᵀ S⁻¹ r of all its views
  int rows = 0;                                        ///< degrees of freedom of nis
  bool used = false;                                   ///< passed the gate
};

/// Updates the state's points with what the newest clone sees of them. A point whose innovation
/// fails the gate three times in a row, or that lies behind the camera, leaves the state.
/// `innovations`, where it is given, is filled.
///
/// Where most points fail at once, and by far, the images contradict the prediction as a whole:
/// the pose is then widened by `VisionOptions::jump_*` before the gates are asked again, counted as
/// "images_jumped". `may_jump`: whether such a contradiction would be a sudden one.
Result<UpdateCounts> updateSlam(State& state, const FeatureDatabase& database,
                                const VisionOptions& options, bool may_jump, ReasonCounts& reasons,
                                std::vector<Innovation>* innovations = nullptr);

/// Puts the track's point into the state, and uses all its views. Fails with the reason of
/// triangulation, "slam_gated", or that of the update.
Result<void> initialisePoint(State& state, const Track& track, const VisionOptions& options);

}  // namespace perdure::vio

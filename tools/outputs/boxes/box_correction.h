// Estimates a scale and a shift of boxes on each image axis, with which the centres of each track
// are views of one point (variable projection; robust weights of the tracks).
#pragma once

#include <vector>

#include "tools/outputs/boxes/box_tracks.h"

namespace perdure::tools {

/// Right x = scale.x · given x + shift.x; the same for y.
struct BoxCorrection {
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  /// Standard deviations: relative, and px; 0 for what was found to be right.
  Eigen::Vector2d scale_sigma = Eigen::Vector2d::Zero(), shift_sigma_px = Eigen::Vector2d::Zero();

  BoxChange change() const { return {scale.asDiagonal(), shift_px}; }
};

/// Returns only parts that are clearly different from no change, or nothing.
std::optional<BoxCorrection> correctionOf(const std::vector<const BoxTrack*>& tracks,
                                          const FrameGlances& frames, const CameraModel& camera);

}  // namespace perdure::tools

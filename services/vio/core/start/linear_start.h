// Velocity and gravity of a window, linearly with the points eliminated (Dong-Si & Mourikis, IROS
// 2012), the length of gravity being known. Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "common/camera/camera_model.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

/// An image of the window, and the increment of the inertial samples until then, in B0.
struct Keyframe {
  double t = 0.0;     ///< since the first
  Eigen::Matrix3d R;  ///< R_B0_Bi
  Eigen::Vector3d dp, dv;
  const TrackedFrame* tracked = nullptr;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< of the body, where a shutter rolls
};

/// A point as one camera saw it from one keyframe.
struct LinearView {
  Eigen::Matrix3d R_CB0;    ///< rotates B0 into this camera
  Eigen::Vector3d p_BC_B0;  ///< the camera relative to the body, in B0
  double t;                 ///< since the first keyframe
  Eigen::Vector3d dp;       ///< of the increment until then
  Eigen::Vector2d normalised;
  double scale;
};
using Views = std::map<std::uint64_t, std::vector<LinearView>>;

/// Of the points that two thirds of the keyframes saw, by id.
Views viewsOf(const std::vector<Keyframe>& keyframes, const std::vector<CameraModel>& cameras);

struct LinearStart {
  Eigen::Matrix<double, 6, 1> x;  ///< v0, g in B0
  Eigen::Matrix<double, 6, 6> information;
  double rms_px = 0.0;
  double in_front = 0.0;  ///< share of points in front of all their cameras
};

/// In B0.
struct PointEstimate {
  Eigen::Vector3d f = Eigen::Vector3d::Zero();
  bool known = false;
};

/// One weighted linear solution; depths of the last one weigh this one's rows.
LinearStart solveOnce(const Views& views, std::map<std::uint64_t, PointEstimate>& points,
                      const Eigen::Matrix<double, 6, 1>& x_before, double gravity);

/// The argmin of ½ gᵀ M g − dᵀ g with |g| = length; M symmetric, positive semidefinite.
Eigen::Vector3d solveOnSphere(const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double length);

}  // namespace perdure::vio

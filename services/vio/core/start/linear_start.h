// Linear estimate of velocity and gravity over a window. The points are eliminated (Dong-Si &
// Mourikis, IROS 2012), and the length of gravity is known. Derivation:
// tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "common/camera/camera_model.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

/// An image of the window, and the inertial increment from the first image to it, in B0.
struct Keyframe {
  double t = 0.0;     ///< s since the first keyframe
  Eigen::Matrix3d R;  ///< R_B0_Bi
  Eigen::Vector3d dp, dv;
  const TrackedFrame* tracked = nullptr;
  /// Angular rate of the body, rad/s in B; used only with a rolling shutter.
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
};

/// Observation of a point by one camera at one keyframe.
struct LinearView {
  Eigen::Matrix3d R_CB0;    ///< rotates B0 into this camera
  Eigen::Vector3d p_BC_B0;  ///< position of the camera relative to the body, in B0
  double t;                 ///< s since the first keyframe
  Eigen::Vector3d dp;       ///< position increment up to this keyframe
  Eigen::Vector2d normalised;
  double scale;
};
using Views = std::map<std::uint64_t, std::vector<LinearView>>;

/// Returns, by id, the views of the points that at least two thirds of the keyframes saw.
Views viewsOf(const std::vector<Keyframe>& keyframes, const std::vector<CameraModel>& cameras);

struct LinearStart {
  Eigen::Matrix<double, 6, 1> x;  ///< [v0; g] in B0, m/s and m/s²
  Eigen::Matrix<double, 6, 6> information;
  double rms_px = 0.0;
  double in_front = 0.0;  ///< share of points in front of all cameras that saw them
};

struct PointEstimate {
  Eigen::Vector3d f = Eigen::Vector3d::Zero();
  bool known = false;
};

/// Computes one weighted linear solution. The rows are weighted by the depths of the previous
/// solution.
LinearStart solveOnce(const Views& views, std::map<std::uint64_t, PointEstimate>& points,
                      const Eigen::Matrix<double, 6, 1>& x_before, double gravity);

/// Minimises ½ gᵀ M g − dᵀ g with |g| = length; M is symmetric, positive semidefinite.
Eigen::Vector3d solveOnSphere(const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double length);

}  // namespace perdure::vio

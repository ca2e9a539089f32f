// Robust least squares over lens, pose of the camera on the IMU, time offset, readout and gyroscope
// bias, from tracked corners. The body moves as the IMU measures. Each window has its own initial
// velocity and gravity, and each corner its own inverse depth; all of these are eliminated (Schur
// complement). Corners without parallax constrain the rotation only.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tools/calibrate/motion/track_windows.h"
#include "tools/data_check/clock_parts.h"

namespace perdure::calibrate {

/// Order of the parameters: rotation (right of R_BC), time offset, readout, gyroscope bias,
/// relative focal length, principal point, k1, k2, p_BC.
inline constexpr int kParameters = 16;
enum JointIndex : int {
  kTurnOf = 0,
  kLater = 3,
  kReadout = 4,
  kBias = 5,
  kFocal = 8,
  kCentre = 9,
  kDistortion = 11,
  kPlace = 13
};
using JointVector = Eigen::Matrix<double, kParameters, 1>;
using JointMatrix = Eigen::Matrix<double, kParameters, kParameters>;

struct JointState {
  CameraCalibration camera;  ///< radial-tangential, equidistant or none
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
};
/// Returns `state` changed by a small `step`.
JointState moved(const JointState& state, const JointVector& step);
JointVector between(const JointState& from, const JointState& to);

struct JointOptions {
  JointState prior;         ///< means of the priors; also the initial estimate
  JointVector prior_sigma;  ///< infinite: no prior
  int most_rounds = 30;
};

struct JointEstimate {
  JointState state;
  JointVector sigma;         ///< standard deviations, scaled by the residuals
  /// From the earlier to the later half of the windows, by one step.
  JointVector change = JointVector::Zero();
  double residual_px = 0.0;  ///< robust standard deviation of a residual
  double inliers = 0.0;      ///< share of the residuals below three of these
  std::size_t windows = 0, residuals = 0;
  /// The time offset of each window, with the other parameters of all windows.
  std::vector<tools::PartOffset> offsets;
};

JointEstimate estimateJointly(const std::vector<TrackWindow>& windows,
                              const std::vector<ImuSample>& samples, const JointOptions& options);

}  // namespace perdure::calibrate

// The maximum a posteriori of a window in motion: poses, velocities, direction of gravity, both
// biases, the time offset and the points, from images and inertial samples together
// (Levenberg-Marquardt, points eliminated). Its covariance is that of the start. Derivation:
// tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"

namespace perdure::vio {

/// One view of a point.
struct WindowView {
  std::size_t keyframe = 0;
  Eigen::Matrix3d R_BC;
  Eigen::Vector3d p_BC;
  Eigen::Vector2d normalised;
  Eigen::Matrix2d to_pixels;  ///< ∂pixel / ∂normalised
  double row_s = 0.0;         ///< of a rolling shutter: its row is later than the pose by so much
};

struct WindowPoint {
  Eigen::Vector3d p_B0;  ///< in the first body frame, where the search begins
  std::vector<WindowView> views;
};

struct WindowPose {
  TimePoint time;  ///< IMU clock
  Eigen::Matrix3d R_B0_B = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0 = Eigen::Vector3d::Zero(), v_B0 = Eigen::Vector3d::Zero();
};

/// What is estimated. The first pose is the frame of reference: rotation and position stay.
struct MotionWindow {
  std::vector<WindowPose> poses;
  std::vector<WindowPoint> points;
  Eigen::Vector3d gravity_B0 = Eigen::Vector3d::Zero();  ///< of known length
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  double time_offset_s = 0.0;  ///< of the images, beside what `poses` have already
};

/// Errors of the newest pose and what belongs to the window: [θ, v (B0), gravity (2), b_g, b_a].
inline constexpr int kWindowError = 14;
using WindowCovariance = Eigen::Matrix<double, kWindowError, kWindowError>;
/// Two directions across gravity, times its length: gravity's error in B0 is this times its two.
Eigen::Matrix<double, 3, 2> acrossGravity(const Eigen::Vector3d& gravity_B0);

struct RefinedWindow {
  MotionWindow window;
  WindowCovariance covariance;  ///< scaled up where the residuals are larger than they should be
  double cost = 0.0;            ///< twice the negative logarithm of the posterior, robust
  double image_noise = 1.0;     ///< of the views, in deviations; 1 where they are as expected
  double noise_ratio = 1.0;     ///< root of the cost for each degree of freedom; 1 where all fits
};

/// Fails with "start_inconsistent" where no minimum is found, "start_unobservable" where the
/// information is singular, and as the inertial samples do (motion_terms.h).
Result<RefinedWindow> refine(MotionWindow window, const ImuBuffer& imu, const Options& options);

}  // namespace perdure::vio

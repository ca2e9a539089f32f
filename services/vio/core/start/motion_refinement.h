// Maximum a posteriori estimate of a window in motion (Levenberg-Marquardt, points eliminated),
// whose covariance is the start's; tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"

namespace perdure::vio {

struct WindowView {
  std::size_t keyframe = 0;
  Eigen::Matrix3d R_BC;
  Eigen::Vector3d p_BC;
  Eigen::Vector2d normalised;
  Eigen::Matrix2d to_pixels;  ///< ∂pixel / ∂normalised
  double row_s = 0.0;         ///< s from the pose to the point's row of a rolling shutter
};

struct WindowPoint {
  Eigen::Vector3d p_B0;  ///< initial value, in the first body frame
  std::vector<WindowView> views;
};

struct WindowPose {
  TimePoint time;  ///< IMU clock
  Eigen::Matrix3d R_B0_B = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0 = Eigen::Vector3d::Zero(), v_B0 = Eigen::Vector3d::Zero();
};

/// Estimated quantities. The first pose is the frame of reference: its R and p are fixed.
struct MotionWindow {
  std::vector<WindowPose> poses;
  std::vector<WindowPoint> points;
  Eigen::Vector3d gravity_B0 = Eigen::Vector3d::Zero();  ///< fixed length
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  /// Time offset of the images, in addition to that applied to `poses`.
  double time_offset_s = 0.0;
};

/// Error of the newest pose and of the window's parameters: [θ, v (B0), gravity (2), b_g, b_a].
inline constexpr int kWindowError = 14;
using WindowCovariance = Eigen::Matrix<double, kWindowError, kWindowError>;
/// Two directions across gravity of its length: times two error components, the error in B0.
Eigen::Matrix<double, 3, 2> acrossGravity(const Eigen::Vector3d& gravity_B0);

struct RefinedWindow {
  MotionWindow window;
  WindowCovariance covariance;  ///< enlarged if the residuals are larger than expected
  double cost = 0.0;            ///< twice the negative log posterior, with robust terms
  double image_noise = 1.0;     ///< RMS of the views' residuals, in deviations; 1 if as expected
  double noise_ratio = 1.0;     ///< root of the cost per degree of freedom; 1 if all terms fit
};

/// Fails with "start_inconsistent" if it finds no minimum, and with "start_unobservable" if the
/// information is singular. The failures of inertialOf() (motion_terms.h) are passed on.
Result<RefinedWindow> refine(MotionWindow window, const ImuBuffer& imu, const Options& options);

// Defined in motion_search.cpp: the best minimum of a window from several initial values.

/// Largest error of a usable velocity, as a share of the largest velocity in the window. The same
/// limit applies to the distance of other minima that fit about as well.
inline constexpr double kVelocityShare = 0.16;

void placePoints(MotionWindow& window);

/// Fails as refine() does, and with "start_unobservable" if another minimum fits about as well.
Result<RefinedWindow> searchMinimum(MotionWindow window, const ImuBuffer& imu,
                                    const Options& options);

}  // namespace perdure::vio

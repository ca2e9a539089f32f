// Maximum a posteriori estimate of a window in motion by Levenberg-Marquardt, with the points
// eliminated. Its covariance becomes that of the start. Derivation: tools/docs/maths/vio-starts.md.
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
  Eigen::Vector3d gravity_B0 = Eigen::Vector3d::Zero();  ///< m/s², of fixed length
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  /// Time offset of the images, in addition to the one that the times of `poses` include.
  double time_offset_s = 0.0;
};

/// Error of the newest pose and of the window's parameters: [θ, v (B0), gravity (2), b_g, b_a].
inline constexpr int kWindowError = 14;
using WindowCovariance = Eigen::Matrix<double, kWindowError, kWindowError>;
/// Returns two vectors across gravity with its length. Multiplied by the two components of the
/// gravity error, they give the error in B0.
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

// The following are defined in motion_search.cpp: a search from several initial values.

/// Largest standard deviation of a usable velocity, as a share of the largest velocity in the
/// window. The velocities of minima that fit about as well may not differ by a larger share.
inline constexpr double kVelocityShare = 0.16;

void placePoints(MotionWindow& window);

/// Returns the best minimum. Fails as refine() does, and with "start_unobservable" if another
/// minimum with a different velocity fits about as well.
Result<RefinedWindow> searchMinimum(std::vector<MotionWindow> beginnings, const ImuBuffer& imu,
                                    const Options& options);

}  // namespace perdure::vio

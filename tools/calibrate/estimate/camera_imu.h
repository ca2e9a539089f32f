// The place of a camera on an IMU, their time offset, the lens, the IMU's biases and gravity, from
// one recording of a board: one least-squares problem over a continuous-time trajectory (Furgale,
// Rehder, Siegwart, "Unified Temporal and Spatial Calibration for Multi-Sensor Systems", IROS
// 2013). Unlike there the lens is estimated along, and biases are piecewise linear walks.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "tools/calibrate/estimate/alignment.h"
#include "tools/calibrate/estimate/intrinsics.h"
#include "tools/calibrate/estimate/spline.h"

namespace perdure::calibrate {

struct CameraImuOptions {
  double gravity = 9.81;         ///< m/s², at the place of use
  double widest_offset_s = 0.3;  ///< of the search for a time offset
  double longest_gap_s = 1.0;    ///< without the board in view; a longer one ends the stretch
  bool hold_lens = false;        ///< the lens stays as it is given
};

struct CameraImuInput {
  Board board;
  std::vector<View> views;         ///< by time
  std::vector<ImuSample> samples;  ///< by time
  CameraCalibration camera;        ///< lens; T_BC's position is the first guess
  ImuCalibration imu;              ///< noise densities
  double sigma_px = 0.1;           ///< first guess of a corner's deviation
};

/// Order of the covariance: θ (right of R_BC), p_BC, time offset, lens.
inline constexpr int kRotationAt = 0, kPositionAt = 3, kOffsetAt = 6, kLensAt = 7;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// What is left of a sensor's samples, as a multiple of the declared white noise.
struct NoiseCheck {
  double ratio = 0.0;
  double correlation = 0.0;  ///< of neighbouring residuals, -1 … 1; white noise has none
};

struct ImuResidual {
  double time_s = 0.0;
  Eigen::Vector3d gyro, accel;  ///< rad/s, m/s²
};

struct CameraImu {
  CameraCalibration camera;  ///< with T_BC and time offset
  Matrix15d covariance = Matrix15d::Zero();
  /// Residuals that are near in time go together (a corner errs with its neighbours): by so much
  /// the covariance is wider than that of independent ones.
  double widened = 1.0;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = gyro_bias;  ///< means
  Eigen::Vector3d gyro_bias_sigma = gyro_bias, accel_bias_sigma = gyro_bias;
  Eigen::Vector3d gravity_T = gyro_bias;  ///< m/s², in the board's frame
  double from_s = 0.0, to_s = 0.0;        ///< the stretch, since the first view
  double knot_interval_s = 0.0;
  Eigen::Vector3d rate_rms_B = gyro_bias, accel_rms_B = gyro_bias;  ///< how much it was moved
  double sigma_px = 0.0;                                            ///< from the residuals
  std::size_t views = 0, corners = 0, outliers = 0, samples = 0;
  NoiseCheck gyro, accel;
  std::vector<CornerResidual> residuals;
  std::vector<ImuResidual> imu_residuals;
  Spline spline;
};

/// Fails with the reasons of alignRates, calibrate_few_views, calibrate_imu_missing,
/// calibrate_imu_saturated, calibrate_no_convergence or calibrate_not_observable.
Result<CameraImu> estimateCameraImu(const CameraImuInput& input, const CameraImuOptions& options);

/// The widest spacing of knots with which a spline follows the samples as well as it does with the
/// narrowest one; seconds.
double chooseKnotInterval(const std::vector<ImuReading>& readings);

}  // namespace perdure::calibrate

// Estimates a camera's pose on an IMU, time offset, lens, biases and gravity from a board, in one
// least-squares problem over a continuous-time trajectory (Furgale, Rehder, Siegwart, IROS 2013).
// Additions: the lens is estimated too, and biases are random walks.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "tools/calibrate/estimate/alignment.h"
#include "tools/calibrate/estimate/intrinsics.h"
#include "tools/calibrate/estimate/spline.h"

namespace perdure::calibrate {

struct CameraImuOptions {
  double gravity = 9.81;         ///< m/s², at the place of the recording
  double widest_offset_s = 0.3;  ///< largest time offset of the search
  double longest_gap_s = 1.0;    ///< longest time without the board; a longer one ends the stretch
  bool hold_lens = false;        ///< keeps the given lens constant
};

struct CameraImuInput {
  Board board;
  std::vector<View> views;         ///< sorted by time
  std::vector<ImuSample> samples;  ///< sorted by time
  CameraCalibration camera;        ///< lens; T_BC's position is the initial estimate
  ImuCalibration imu;              ///< noise densities
  double sigma_px = 0.1;           ///< initial standard deviation of a corner
};

/// Order of the covariance: θ (right of R_BC), p_BC, time offset, lens.
inline constexpr int kRotationAt = 0, kPositionAt = 3, kOffsetAt = 6, kLensAt = 7;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// RMS residual of a sensor's samples, as a multiple of the declared white noise.
struct NoiseCheck {
  double ratio = 0.0;
  double correlation = 0.0;  ///< correlation of neighbours, -1 … 1; 0 for white noise
};

struct ImuResidual {
  double time_s = 0.0;
  Eigen::Vector3d gyro, accel;  ///< rad/s, m/s²
};

struct CameraImu {
  CameraCalibration camera;  ///< includes T_BC and the time offset
  Matrix15d covariance = Matrix15d::Zero();
  /// Factor by which the covariance exceeds that of independent residuals. Residuals close in time
  /// are correlated, because the errors of neighbouring corners are correlated.
  double widened = 1.0;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = gyro_bias;  ///< mean biases
  Eigen::Vector3d gyro_bias_sigma = gyro_bias, accel_bias_sigma = gyro_bias;
  Eigen::Vector3d gravity_T = gyro_bias;  ///< m/s², in the board's frame
  /// Start and end of the used time interval, in s since the first view.
  double from_s = 0.0, to_s = 0.0;
  double knot_interval_s = 0.0;
  Eigen::Vector3d rate_rms_B = gyro_bias, accel_rms_B = gyro_bias;  ///< RMS motion along each axis
  double sigma_px = 0.0;                                            ///< estimated from residuals
  std::size_t views = 0, corners = 0, outliers = 0, samples = 0;
  NoiseCheck gyro, accel;
  std::vector<CornerResidual> residuals;
  std::vector<ImuResidual> imu_residuals;
  Spline spline;
};

/// Fails with the reasons of alignRates, or with calibrate_few_views, calibrate_imu_missing,
/// calibrate_imu_saturated, calibrate_no_convergence or calibrate_not_observable.
Result<CameraImu> estimateCameraImu(const CameraImuInput& input, const CameraImuOptions& options);

/// The largest knot spacing in s that fits the samples as well as the smallest one.
double chooseKnotInterval(const std::vector<ImuReading>& readings);

}  // namespace perdure::calibrate

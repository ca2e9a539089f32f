// Options of the filter's core. Defaults suit a 20 Hz camera with a 200 Hz MEMS IMU.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "services/vio/core/state/state.h"

namespace perdure::vio {

struct ImuNoise {
  double gyro = 1.7e-4;        ///< rad/s/√Hz
  double gyro_walk = 2.0e-5;   ///< rad/s²/√Hz
  double accel = 2.0e-3;       ///< m/s²/√Hz
  double accel_walk = 3.0e-3;  ///< m/s³/√Hz
  /// Factor on all four densities in propagation, because errors are larger in motion. It is not
  /// used in the tests for rest.
  double inflation = 1.0;
  /// At longer intervals, samples are treated as momentary values instead of averages. The error of
  /// the linear interpolation between them is then added to the noise.
  double interpolation_from_s = 0.02;
  double interpolation_gyro = 0.005;  ///< rad/s per sample, lower limit of that error
  double interpolation_accel = 0.1;   ///< m/s² per sample, lower limit of that error
  /// A longer time without samples is a gap. Noise for the body's unknown motion is then added.
  double gap_from_s = 0.2;
  double gap_gyro = 0.3;   ///< rad/s
  double gap_accel = 1.5;  ///< m/s²
};

struct WindowOptions {
  std::int64_t clones = 11;           ///< number of poses in the sliding window
  std::int64_t slam_features = 36;    ///< largest number of points in the state
  std::int64_t msckf_features = 24;   ///< largest number, in a frame, of points used once
  std::int64_t min_observations = 4;  ///< least number of views of a track used once
  bool first_estimates = true;        ///< Jacobians at first estimates, which updates do not change
};

struct VisionOptions {
  double sigma_px = 0.4;
  double gate_probability = 0.95;
  double min_depth_m = 0.1, max_depth_m = 75.0;
  /// Rays are parallel if their normal matrix has a larger condition number.
  double max_condition = 10000.0;
  /// Largest standard deviation along the ray, relative to the depth, of a point of the state.
  double max_relative_sigma = 0.4;
  /// Standard deviations of a jump of the pose. A jump is assumed if nearly all points of a frame
  /// contradict the prediction.
  double jump_position_m = 0.3;
  double jump_rotation = 0.03;  ///< rad
  /// Standard deviation, relative to the mean, of the inverse depth of a point without parallax.
  double scene_scatter = 0.7;

  /// Mean inverse depth, in 1/m, of a scene's points without parallax, and the deviation of its
  /// logarithm. The depth limits are two deviations from the mean.
  double sceneInverse() const { return 1.0 / std::sqrt(min_depth_m * max_depth_m); }
  double sceneSigma() const { return 0.25 * std::log(max_depth_m / min_depth_m); }
};

struct CalibrationOptions {
  bool estimate_extrinsics = true, estimate_time_offset = true;
  bool estimate_readout = true;       ///< estimate the read-out time of a rolling shutter
  double extrinsic_rotation = 0.005;  ///< rad
  double extrinsic_position_m = 0.01;
  /// Factor on both deviations for the second camera, whose pose relative to the first is more
  /// precise.
  double second_camera_factor = 0.1;
  double time_offset_s = 0.005;
  double readout_s = 0.005;  ///< deviation of the read-out time of a rolling shutter
  double gyro_scale = 0.0;   ///< deviation of each axis from 1; 0: exact, not estimated
  double focal = 0.0;        ///< relative deviation of the focal length; 0: lens not estimated
  double centre_px = 6.0;    ///< deviation of the principal point, if the lens is estimated
  double distortion = 0.03;  ///< deviation of k1 and k2, if the lens is estimated

  Estimated estimated() const { return {estimate_readout, gyro_scale > 0.0, focal > 0.0}; }
  LensError lensSigma() const {
    return (LensError() << focal, centre_px, centre_px, distortion, distortion).finished();
  }
};

struct StartOptions {
  double rest_window_s = 0.5;      ///< duration of rest before a start at rest
  double rest_disparity_px = 0.7;  ///< largest median image motion over that window
  double still_window_s = 2.0;     ///< duration of rest if traffic moves in the image
  double rest_accel_m_s2 = 1.0;    ///< largest difference between mean force and gravity
  double motion_window_s = 2.0;    ///< longest window of a start in motion
  double tilt_sigma = 0.03;        ///< rad, at a start with a speed sensor
  double gyro_bias_sigma = 0.02;   ///< rad/s
  double accel_bias_sigma = 0.1;   ///< m/s²
  double velocity_sigma = 0.3;     ///< m/s
};

struct RestOptions {
  bool enabled = true;
  double disparity_px = 0.5;  ///< largest median image motion over the last frames
  std::int64_t frames = 5;    ///< number of frames for disparity_px
  double speed_sigma = 0.02;  ///< m/s
  double position_sigma_m = 0.005;
  double rotation_sigma = 0.001;  ///< rad
  /// Least share of points, the background of traffic, that rest for a second while others move.
  double still_share = 0.15;
  double max_rate = 0.15;  ///< rad/s, mean over a frame, bias removed
  double max_speed = 0.5;  ///< m/s, largest estimated speed at which rest is accepted
};

struct SpeedOptions {
  bool enabled = true;
  double sigma_factor = 1.0;  ///< factor on the sigma of each sample
  double min_sigma = 0.05;    ///< m/s
  bool planar = false;        ///< constrain lateral and vertical velocity to zero
  double lateral_sigma = 0.15, vertical_sigma = 0.15;  ///< m/s
  double max_age_s = 0.15;
};

struct Options {
  ImuNoise imu;
  WindowOptions window;
  VisionOptions vision;
  CalibrationOptions calibration;
  StartOptions start;
  RestOptions rest;
  SpeedOptions speed;
  double gravity = 9.81;  ///< m/s²
};

}  // namespace perdure::vio

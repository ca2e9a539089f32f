// Options of the filter's core. Defaults suit a 20 Hz camera with a 200 Hz MEMS IMU.
#pragma once

#include <cmath>
#include <cstdint>

namespace perdure::vio {

struct ImuNoise {
  double gyro = 1.7e-4;        ///< rad/s/√Hz
  double gyro_walk = 2.0e-5;   ///< rad/s²/√Hz
  double accel = 2.0e-3;       ///< m/s²/√Hz
  double accel_walk = 3.0e-3;  ///< m/s³/√Hz
  /// Factor on all four densities in propagation, for errors beyond rest; not in the rest tests.
  double inflation = 1.0;
  /// Samples with a longer interval are treated as momentary values, not averages. The error of
  /// linear interpolation between them is added to the noise.
  double interpolation_from_s = 0.02;
  double interpolation_gyro = 0.005;  ///< rad/s per sample, lower limit of that error
  double interpolation_accel = 0.1;   ///< m/s² per sample, lower limit of that error
  /// A longer time without samples is a gap, in which noise is added for the body's motion.
  double gap_from_s = 0.2;
  double gap_gyro = 0.3;   ///< rad/s
  double gap_accel = 1.5;  ///< m/s²
};

struct WindowOptions {
  std::int64_t clones = 11;           ///< poses in the sliding window
  std::int64_t slam_features = 36;    ///< points in the state
  std::int64_t msckf_features = 24;   ///< points used once, per frame
  std::int64_t min_observations = 4;  ///< least image points of a track that is used once
  bool first_estimates = true;        ///< Jacobians at first estimates, which updates do not change
};

struct VisionOptions {
  double sigma_px = 0.4;
  double gate_probability = 0.95;
  double min_depth_m = 0.1, max_depth_m = 75.0;
  /// Rays whose normal matrix has a larger condition number are parallel.
  double max_condition = 10000.0;
  /// Largest standard deviation along the ray, relative to the depth, of a point of the state.
  double max_relative_sigma = 0.4;
  /// Possible jump of the pose, assumed if nearly all points of a frame contradict the prediction.
  double jump_position_m = 0.3;
  double jump_rotation = 0.03;  ///< rad
  /// Deviation of the inverse depth of a point without parallax, relative to its mean.
  double scene_scatter = 0.7;

  /// Mean inverse depth of a point without parallax, and the deviation of its logarithm for the
  /// whole scene. The two depth limits are at two deviations.
  double sceneInverse() const { return 1.0 / std::sqrt(min_depth_m * max_depth_m); }
  double sceneSigma() const { return 0.25 * std::log(max_depth_m / min_depth_m); }
};

struct CalibrationOptions {
  bool estimate_extrinsics = true, estimate_time_offset = true;
  bool estimate_readout = true;       ///< estimates the readout of a rolling shutter
  double extrinsic_rotation = 0.005;  ///< rad
  double extrinsic_position_m = 0.01;
  /// Factor on both deviations, because the pose within the pair is more precise.
  double second_camera_factor = 0.1;
  double time_offset_s = 0.005;
  double readout_s = 0.005;  ///< deviation of the read-out time of a rolling shutter
  double gyro_scale = 0.0;   ///< deviation of each axis from 1; 0: exact, not estimated
};

struct StartOptions {
  double rest_window_s = 0.5;      ///< duration of rest before a start at rest
  double rest_disparity_px = 0.7;  ///< largest median image motion over that window
  double still_window_s = 2.0;     ///< duration of rest if traffic moves in the image
  double rest_accel_m_s2 = 1.0;    ///< largest difference between the mean force and gravity
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
  /// Least share of points that stay for a second while others move: the background of traffic.
  double still_share = 0.15;
  double max_rate = 0.15;  ///< rad/s, mean over a frame, bias removed
  double max_speed = 0.5;  ///< m/s, largest estimated speed at which rest is accepted
};

struct SpeedOptions {
  bool enabled = true;
  double sigma_factor = 1.0;  ///< factor on the sigma of each sample
  double min_sigma = 0.05;    ///< m/s
  bool planar = false;        ///< lateral and vertical velocity are about zero
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

// What the filter's core can be told. Defaults suit a 20 Hz camera with a 200 Hz MEMS IMU.
#pragma once

#include <cstdint>

namespace perdure::vio {

/// Continuous-time densities of the inertial noise.
struct ImuNoise {
  double gyro = 1.7e-4;        ///< rad/s/√Hz
  double gyro_walk = 2.0e-5;   ///< rad/s²/√Hz
  double accel = 2.0e-3;       ///< m/s²/√Hz
  double accel_walk = 3.0e-3;  ///< m/s³/√Hz
  /// On all four where the state is propagated: errors that a unit at rest does not show. Whether
  /// the body rests is judged without it.
  double inflation = 1.0;
  /// Samples further apart than this are treated as sampled, not averaged: the error of the
  /// linear interpolation between them joins the noise.
  double interpolation_from_s = 0.02;
  double interpolation_gyro = 0.005;  ///< rad/s per sample, floor of that error
  double interpolation_accel = 0.1;   ///< m/s² per sample, floor of that error
  /// A longer time without samples is a gap, in which the body may have done this:
  double gap_from_s = 0.2;
  double gap_gyro = 0.3;   ///< rad/s
  double gap_accel = 1.5;  ///< m/s²
};

struct WindowOptions {
  std::int64_t clones = 11;           ///< poses in the sliding window
  std::int64_t slam_features = 36;    ///< points kept in the state
  std::int64_t msckf_features = 24;   ///< points used once, per frame
  std::int64_t min_observations = 4;  ///< of a track that is used once
  bool first_estimates = true;        ///< Jacobians on a path that no update moves
};

struct VisionOptions {
  double sigma_px = 0.4;
  double gate_probability = 0.95;
  double min_depth_m = 0.1, max_depth_m = 75.0;
  double max_condition = 10000.0;  ///< of a triangulation's normal matrix
  /// Largest standard deviation along the ray, relative to the depth, at which a point may enter
  /// the state.
  double max_relative_sigma = 0.4;
  /// Where nearly all points of a frame contradict the prediction, the pose may have jumped so far.
  double jump_position_m = 0.3;
  double jump_rotation = 0.03;  ///< rad
};

/// Standard deviations of what the calibration says.
struct CalibrationOptions {
  bool estimate_extrinsics = true, estimate_time_offset = true;
  bool estimate_readout = true;       ///< of a rolling shutter
  double extrinsic_rotation = 0.005;  ///< rad
  double extrinsic_position_m = 0.01;
  double second_camera_factor = 0.1;  ///< a stereo pair is calibrated better among itself
  double time_offset_s = 0.005;
  double readout_s = 0.005;  ///< of a rolling shutter
  double gyro_scale = 0.0;   ///< of each axis, from 1; 0: exact, not estimated
};

struct StartOptions {
  double rest_window_s = 0.5;      ///< time at rest before a start at rest
  double rest_disparity_px = 0.7;  ///< median image motion over that window
  double still_window_s = 2.0;     ///< the same while traffic moves past a background at rest
  double rest_accel_m_s2 = 1.0;    ///< largest difference of the mean force from gravity
  double motion_window_s = 2.0;    ///< of a start in motion, at most
  double tilt_sigma = 0.03;        ///< rad, at a start with speed
  double gyro_bias_sigma = 0.02;   ///< rad/s
  double accel_bias_sigma = 0.1;   ///< m/s²
  double velocity_sigma = 0.3;     ///< m/s
};

struct RestOptions {
  bool enabled = true;
  double disparity_px = 0.5;  ///< median image motion over the last frames
  std::int64_t frames = 5;    ///< how many of them
  double speed_sigma = 0.02;  ///< m/s
  double position_sigma_m = 0.005;
  double rotation_sigma = 0.001;  ///< rad
  /// Of the points, that keep their place for a second while the others move: the background of a
  /// body that stands in traffic.
  double still_share = 0.15;
  double max_rate = 0.15;  ///< rad/s, mean over a frame, bias removed
  double max_speed = 0.5;  ///< m/s: the filter's own belief must not exceed it
};

struct SpeedOptions {
  bool enabled = true;
  double sigma_factor = 1.0;  ///< on the sigma that comes with each sample
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

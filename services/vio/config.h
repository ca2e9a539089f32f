// Configuration of vio. describe() defines the keys and their meanings.
#pragma once

#include <string>
#include <vector>

#include "common/config/fields.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/tracks/tracker.h"
#include "services/vio/moving_mask.h"

namespace perdure::vio {

struct Config {
  Options core;
  TrackerOptions tracker;
  MovingMaskOptions moving_mask;
  std::vector<std::string> cameras{"cam0", "cam1"};  ///< for main: cameras whose frames are read
  std::string odometry = "estimated";                ///< or "given": by another program
  bool stereo = true;                                ///< use the second camera, if present
  bool prefer_calibration = true;                    ///< use the calibration's IMU noise if present
  double imu_inflation = 3.0;      ///< factor on the IMU's noise densities in propagation
  double gyro_scale = 0.01;        ///< standard deviation of the gyroscope's scale
  double imu_slack_s = 0.0;        ///< time after a frame up to which samples must exist
  double pair_tolerance_s = 0.01;  ///< largest difference between the two cameras' stamps
  double speed_wait_s = 0.12;      ///< longest wait of a frame for its speed sample
  double longest_gap_s = 2.0;      ///< a longer IMU gap ends the frame of reference
  /// A longer time with neither samples nor frames also ends the frame of reference.
  double longest_blackout_s = 0.8;
  std::int64_t max_pending = 40;   ///< largest number of frames that wait for IMU samples
  double position_growth_m = 2.0;  ///< growth of the deviation in 10 s; above: degraded
  double restore_age_s = 10.0;     ///< an older saved state is not resumed
  std::string state_directory;     ///< for main: directory of the saved state; empty: not saved
};

void describe(Config& config, config::Fields& fields);

}  // namespace perdure::vio

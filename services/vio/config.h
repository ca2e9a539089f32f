// Configuration of vio; describe() holds the meaning of the fields.
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
  std::vector<std::string> cameras{"cam0", "cam1"};  ///< main: cameras whose frames are read
  std::string odometry = "estimated";                ///< or "given": by another program
  bool stereo = true;                                ///< use the second camera, if present
  bool prefer_calibration = true;                    ///< use the calibration's IMU noise
  double imu_inflation = 3.0;      ///< factor on the inertial noise densities, in propagation
  double gyro_scale = 0.01;        ///< deviation of the gyroscope's scale from 1
  double imu_slack_s = 0.0;        ///< time to wait for samples after a frame
  double pair_tolerance_s = 0.01;  ///< largest difference between the two cameras' stamps
  double speed_wait_s = 0.12;      ///< longest wait of a frame for its speed sample
  double longest_gap_s = 2.0;      ///< a longer IMU gap ends the frame of reference
  /// A longer gap without frames also ends the frame of reference.
  double longest_blackout_s = 0.8;
  std::int64_t max_pending = 40;   ///< frames that wait for their IMU samples
  double position_growth_m = 2.0;  ///< growth of the deviation in 10 s that is degraded
  double restore_age_s = 10.0;     ///< an older saved state is not resumed
  std::string state_directory;     ///< main: directory of the saved state; empty: not saved
};

void describe(Config& config, config::Fields& fields);

}  // namespace perdure::vio

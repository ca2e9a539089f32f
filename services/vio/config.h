// What a person can set of vio; the fields' meaning is in describe().
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
  std::vector<std::string> cameras{"cam0", "cam1"};  ///< main: whose frames are read
  std::string odometry = "estimated";                ///< or "given": by another program
  bool stereo = true;                                ///< use the second camera where there is one
  bool prefer_calibration = true;   ///< the IMU noise that comes with the calibration
  double imu_inflation = 3.0;       ///< on the densities of the inertial noise, in motion
  double gyro_scale = 0.01;         ///< deviation of the gyroscope's scale from 1
  double imu_slack_s = 0.0;         ///< samples are awaited this long past a frame
  double pair_tolerance_s = 0.01;   ///< of two cameras' stamps
  double speed_wait_s = 0.12;       ///< a frame waits this long for its speed sample
  double longest_gap_s = 2.0;       ///< a longer IMU gap ends the frame of reference
  double longest_blackout_s = 0.8;  ///< so does a longer one without frames
  std::int64_t max_pending = 40;    ///< frames that wait for their IMU samples
  double restore_age_s = 10.0;      ///< an older saved state is not resumed
  std::string state_directory;      ///< main: where the state is kept; empty: nowhere
};

void describe(Config& config, config::Fields& fields);

}  // namespace perdure::vio

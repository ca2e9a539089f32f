#include "services/vio/config.h"

namespace perdure::vio {
namespace {

using config::atLeast;
using config::between;
using config::Fields;
using config::positive;

void describeImu(Options& o, Config& c, Fields& f) {
  const char* allan = "set the Allan-variance value of your IMU";
  f.boolean("imu.prefer_calibration", c.prefer_calibration,
            {"noise values of the calibration, if present, replace the four values below"});
  f.number("imu.gyro_noise", o.imu.gyro, positive(),
           {"gyroscope noise density", "rad/s/√Hz", allan});
  f.number("imu.gyro_bias_walk", o.imu.gyro_walk, positive(),
           {"gyroscope bias random walk", "rad/s²/√Hz", allan});
  f.number("imu.accel_noise", o.imu.accel, positive(),
           {"accelerometer noise density", "m/s²/√Hz", allan});
  f.number("imu.accel_bias_walk", o.imu.accel_walk, positive(),
           {"accelerometer bias random walk", "m/s³/√Hz", allan});
}

void describeVision(Options& o, TrackerOptions& t, Config& c, Fields& f) {
  f.boolean("stereo.enabled", c.stereo, {"use the second camera, if present"});
  f.integer("tracker.max_points", t.max_points, between(20, 1000),
            {"largest number of tracked points in the first camera"});
  f.number("vision.sigma_px", o.vision.sigma_px, positive(),
           {"standard deviation of a tracked point", "px"});
  f.number("vision.min_depth", o.vision.min_depth_m, positive(),
           {"smallest depth of a point", "m"});
  f.number("vision.max_depth", o.vision.max_depth_m, positive(), {"largest depth of a point", "m"});
}

void describeCalibration(Options& o, Config& c, Fields& f) {
  f.boolean("calibration.estimate_extrinsics", o.calibration.estimate_extrinsics,
            {"estimate the camera-IMU extrinsics"});
  f.boolean("calibration.estimate_time_offset", o.calibration.estimate_time_offset,
            {"estimate the camera-IMU time offset"});
  f.boolean("calibration.estimate_readout", o.calibration.estimate_readout,
            {"estimate the read-out time of a rolling shutter; 0 in the calibration stays 0"});
  f.number("calibration.gyro_scale", c.gyro_scale, between(0, 0.1),
           {"standard deviation of the gyroscope's scale on each axis, from its data sheet; 0: not "
            "estimated"});
}

void describeAids(Options& o, Fields& f) {
  f.boolean("rest.enabled", o.rest.enabled, {"apply zero-velocity updates at rest"});
  f.boolean("speed.enabled", o.speed.enabled, {"use the topic `speed`"});
  f.boolean("speed.planar", o.speed.planar,
            {"each speed sample also constrains the lateral and vertical velocity of the body to "
             "zero"});
}

void describeInput(Config& c, Fields& f) {
  f.texts("input.cameras", c.cameras,
          {"cameras whose frames are read; odometry is published for frames of the first one"});
  f.choice("input.odometry", c.odometry, {"estimated", "given"},
           {"given: another program publishes `odometry` for the frames, and vio publishes "
            "landmarks only"});
  f.boolean("input.moving_mask", c.moving_mask.enabled,
            {"read `objects`, and use no points on moving objects"});
  f.number(
      "odometry.position_growth", c.position_growth_m, positive(),
      {"growth of the position's standard deviation in ten seconds above which the odometry is "
       "degraded",
       "m"});
  f.text("state.directory", c.state_directory,
         {"folder in which the state is saved each second for the next start; empty: not saved", "",
          "give a folder that the service may write"});
  f.number("state.restore_age", c.restore_age_s, positive(),
           {"largest age of a saved state that is resumed", "s"});
}

void describeExpertImu(Options& o, Config& c, Fields& f) {
  f.number("imu.inflation", c.imu_inflation, between(1, 100),
           {"factor on the noise in propagation, because data sheets refer to a unit at rest"});
  f.number("imu.interpolation_from", o.imu.interpolation_from_s, positive(),
           {"samples with a longer interval are momentary values: interpolation adds noise", "s"});
  f.number("imu.interpolation_gyro", o.imu.interpolation_gyro, atLeast(0),
           {"lower limit of the interpolation noise per sample, gyroscope", "rad/s"});
  f.number("imu.interpolation_accel", o.imu.interpolation_accel, atLeast(0),
           {"lower limit of the interpolation noise per sample, accelerometer", "m/s²"});
  f.number("imu.gap_from", o.imu.gap_from_s, positive(),
           {"a longer time without samples is a gap, which is counted and bridged with high noise",
            "s"});
  f.number("imu.gap_gyro", o.imu.gap_gyro, atLeast(0),
           {"noise of the gyroscope during a gap", "rad/s"});
  f.number("imu.gap_accel", o.imu.gap_accel, atLeast(0),
           {"noise of the accelerometer during a gap", "m/s²"});
  f.number("imu.longest_gap", c.longest_gap_s, positive(),
           {"a longer gap ends the odometry's frame of reference: the epoch increases", "s"});
  f.number("imu.longest_blackout", c.longest_blackout_s, positive(),
           {"a longer gap without frames also ends it, because the clock may have jumped", "s"});
  f.number("imu.slack", c.imu_slack_s, between(0, 1),
           {"a frame waits for samples until this time after its stamp", "s"});
}

void describeExpertWindow(Options& o, Fields& f) {
  f.integer("window.clones", o.window.clones, between(4, 30),
            {"number of past poses in the state"});
  f.integer("window.slam_features", o.window.slam_features, between(0, 100),
            {"largest number of points in the state"});
  f.integer("window.msckf_features", o.window.msckf_features, between(1, 200),
            {"largest number of tracks per frame that are used once"});
  f.integer("window.min_observations", o.window.min_observations, between(3, 30),
            {"least number of image points of a track that is used once, in both cameras "
             "together"});
  f.boolean("window.first_estimates", o.window.first_estimates,
            {"evaluate Jacobians at first estimates, which updates do not change"});
}

void describeExpertVision(Options& o, Fields& f) {
  f.number("vision.gate_probability", o.vision.gate_probability, between(0.5, 0.99999),
           {"probability of the χ² gates: share of correct points that pass"});
  f.number(
      "vision.max_condition", o.vision.max_condition, positive(),
      {"above this condition number of a triangulation's normal matrix the rays are parallel"});
  f.number("vision.max_relative_sigma", o.vision.max_relative_sigma, positive(),
           {"largest relative standard deviation of a triangulated depth"});
  f.number("calibration.extrinsic_rotation", o.calibration.extrinsic_rotation, positive(),
           {"standard deviation of the given extrinsic rotation", "rad"});
  f.number("calibration.extrinsic_position", o.calibration.extrinsic_position_m, positive(),
           {"standard deviation of the given extrinsic position", "m"});
  f.number("calibration.second_camera_factor", o.calibration.second_camera_factor, positive(),
           {"factor on both deviations for the second camera relative to the first"});
  f.number("calibration.time_offset", o.calibration.time_offset_s, positive(),
           {"standard deviation of the given time offset", "s"});
  f.number("calibration.readout", o.calibration.readout_s, positive(),
           {"standard deviation of the given read-out time of a rolling shutter", "s"});
  f.number("calibration.focal", o.calibration.focal, between(0, 0.3),
           {"relative standard deviation of the given focal length; 0: the lens is not estimated"});
  f.number("calibration.centre", o.calibration.centre_px, positive(),
           {"standard deviation of the given principal point, if the lens is estimated", "px"});
  f.number("calibration.distortion", o.calibration.distortion, positive(),
           {"standard deviation of the given k1 and k2, if the lens is estimated"});
}

void describeExpertTracker(TrackerOptions& t, Config& c, Fields& f) {
  f.number("stereo.pair_tolerance", c.pair_tolerance_s, positive(),
           {"largest difference between the stamps of a pair", "s"});
  f.integer("tracker.grid_columns", t.grid_columns, between(1, 50),
            {"columns of the grid for new corners"});
  f.integer("tracker.grid_rows", t.grid_rows, between(1, 50), {"rows of the grid for new corners"});
  f.integer("tracker.pyramid_levels", t.pyramid_levels, between(1, 8),
            {"pyramid levels above the image itself, from image to image"});
  f.integer("tracker.stereo_levels", t.stereo_levels, between(0, 8),
            {"pyramid levels above the image itself, into the second camera"});
  f.integer("tracker.window", t.window_px, between(5, 51), {"side of a Lucas-Kanade patch", "px"});
  f.integer("tracker.iterations", t.iterations, between(1, 100),
            {"largest number of Lucas-Kanade iterations"});
  f.integer("tracker.fast_threshold", t.fast_threshold, between(2, 100),
            {"FAST threshold of new corners"});
  f.number("tracker.min_distance", t.min_distance_px, atLeast(1),
           {"smallest distance between corners", "px"});
  f.number("tracker.similarity", t.similarity, between(0, 1),
           {"smallest similarity of a patch to its first observation; below it, the track ends"});
  f.number("tracker.growth", t.growth, between(1.1, 10),
           {"largest growth of a patch since its first observation; above it, a new point begins"});
  f.number("tracker.ransac", t.ransac_px, positive(),
           {"largest distance from the epipolar line of the image motion", "px"});
  f.number("tracker.stereo_epipolar", t.stereo_px, positive(),
           {"largest distance from the calibration's epipolar line in the second camera", "px"});
}

void describeExpertStart(Options& o, Fields& f) {
  f.number("start.rest_window", o.start.rest_window_s, positive(),
           {"time at rest that a start at rest requires", "s"});
  f.number("start.rest_disparity", o.start.rest_disparity_px, positive(),
           {"largest median image motion at rest over that time", "px"});
  f.number("start.still_window", o.start.still_window_s, positive(),
           {"time at rest that a start requires while most of the image moves", "s"});
  f.number("start.rest_accel", o.start.rest_accel_m_s2, positive(),
           {"largest difference at rest between the mean specific force and gravity", "m/s²"});
  f.number("start.motion_window", o.start.motion_window_s, positive(),
           {"longest time of the data for a start in motion", "s"});
  f.number("start.tilt_sigma", o.start.tilt_sigma, positive(),
           {"standard deviation of the tilt at a start with speed", "rad"});
  f.number("start.gyro_bias_sigma", o.start.gyro_bias_sigma, positive(),
           {"standard deviation of the gyroscope bias at a start in motion", "rad/s"});
  f.number("start.accel_bias_sigma", o.start.accel_bias_sigma, positive(),
           {"standard deviation of the accelerometer bias", "m/s²"});
  f.number("start.velocity_sigma", o.start.velocity_sigma, positive(),
           {"standard deviation of the velocity across the body at a start with speed", "m/s"});
}

void describeExpertRest(Options& o, Fields& f) {
  f.number("rest.disparity", o.rest.disparity_px, positive(),
           {"largest median image motion at rest over rest.frames", "px"});
  f.integer("rest.frames", o.rest.frames, between(1, 10),
            {"number of frames over which the image motion is measured"});
  f.number("rest.speed_sigma", o.rest.speed_sigma, positive(),
           {"standard deviation of the velocity at rest", "m/s"});
  f.number("rest.position_sigma", o.rest.position_sigma_m, positive(),
           {"standard deviation of the change of position between frames at rest", "m"});
  f.number("rest.rotation_sigma", o.rest.rotation_sigma, positive(),
           {"standard deviation of the rotation between frames at rest", "rad"});
  f.number("rest.still_share", o.rest.still_share, between(0.05, 1),
           {"least share of points at rest if the others move, as for a body at rest in traffic"});
  f.number("rest.max_rate", o.rest.max_rate, positive(),
           {"above this rotation rate no zero-velocity update is made", "rad/s"});
  f.number("rest.max_speed", o.rest.max_speed, positive(),
           {"above this estimated speed no zero-velocity update is made", "m/s"});
}

void describeExpertInput(Options& o, Config& c, Fields& f) {
  f.number("speed.sigma_factor", o.speed.sigma_factor, positive(),
           {"factor on the standard deviation of each sample"});
  f.number("speed.min_sigma", o.speed.min_sigma, positive(),
           {"lower limit of the standard deviation of a sample", "m/s"});
  f.number("speed.lateral_sigma", o.speed.lateral_sigma, positive(),
           {"standard deviation of the lateral velocity from zero, for speed.planar", "m/s"});
  f.number("speed.vertical_sigma", o.speed.vertical_sigma, positive(),
           {"standard deviation of the vertical velocity from zero, for speed.planar", "m/s"});
  f.number("speed.max_age", o.speed.max_age_s, positive(),
           {"largest time between a sample and a frame that uses it", "s"});
  f.number("speed.wait", c.speed_wait_s, atLeast(0), {"longest wait of a frame for a sample", "s"});
  f.integer("input.max_pending", c.max_pending, between(2, 1000),
            {"largest number of frames that wait for their inertial samples, or for their poses"});
  f.number("input.moving_mask_from", c.moving_mask.probability, between(0.05, 1),
           {"lowest probability of moving, and of existing, of a moving object"});
  f.number("input.moving_mask_longest", c.moving_mask.longest_s, positive(),
           {"largest age of the objects that are used", "s"});
}

}  // namespace

void describe(Config& c, Fields& f) {
  f.number("gravity", c.core.gravity, between(9.7, 9.9), {"local gravity", "m/s²"});
  describeImu(c.core, c, f);
  describeVision(c.core, c.tracker, c, f);
  describeCalibration(c.core, c, f);
  describeAids(c.core, f);
  describeInput(c, f);
  f.expert(true);
  describeExpertImu(c.core, c, f);
  describeExpertWindow(c.core, f);
  describeExpertVision(c.core, f);
  describeExpertTracker(c.tracker, c, f);
  describeExpertStart(c.core, f);
  describeExpertRest(c.core, f);
  describeExpertInput(c.core, c, f);
  f.expert(false);
}

}  // namespace perdure::vio

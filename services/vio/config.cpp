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
            {"noise that comes with the calibration goes before the four values below"});
  f.number("imu.gyro_noise", o.imu.gyro, positive(),
           {"gyroscope noise density", "rad/s/√Hz", allan});
  f.number("imu.gyro_bias_walk", o.imu.gyro_walk, positive(),
           {"gyroscope bias random walk", "rad/s²/√Hz", allan});
  f.number("imu.accel_noise", o.imu.accel, positive(),
           {"accelerometer noise density", "m/s²/√Hz", allan});
  f.number("imu.accel_bias_walk", o.imu.accel_walk, positive(),
           {"accelerometer bias random walk", "m/s³/√Hz", allan});
  f.number("imu.inflation", c.imu_inflation, between(1, 100),
           {"on the noise, in propagation: a data sheet's unit is at rest"});
  f.number("imu.interpolation_from", o.imu.interpolation_from_s, positive(),
           {"samples further apart are momentary values: interpolation adds noise", "s"});
  f.number("imu.interpolation_gyro", o.imu.interpolation_gyro, atLeast(0),
           {"floor of that noise, per sample", "rad/s"});
  f.number("imu.interpolation_accel", o.imu.interpolation_accel, atLeast(0),
           {"floor of that noise, per sample", "m/s²"});
  f.number("imu.gap_from", o.imu.gap_from_s, positive(),
           {"a longer time without samples is a gap, counted and bridged with much noise", "s"});
  f.number("imu.gap_gyro", o.imu.gap_gyro, atLeast(0), {"noise across a gap", "rad/s"});
  f.number("imu.gap_accel", o.imu.gap_accel, atLeast(0), {"noise across a gap", "m/s²"});
  f.number("imu.longest_gap", c.longest_gap_s, positive(),
           {"a longer gap ends the odometry's frame of reference: epoch goes up", "s"});
  f.number("imu.longest_blackout", c.longest_blackout_s, positive(),
           {"so does a longer one in which no frame came: the clock may have jumped", "s"});
  f.number("imu.slack", c.imu_slack_s, between(0, 1),
           {"samples are awaited this long past a frame", "s"});
}

void describeWindow(Options& o, Fields& f) {
  f.integer("window.clones", o.window.clones, between(4, 30), {"past poses in the state"});
  f.integer("window.slam_features", o.window.slam_features, between(0, 100),
            {"points in the state"});
  f.integer("window.msckf_features", o.window.msckf_features, between(1, 200),
            {"points used once, per frame"});
  f.integer("window.min_observations", o.window.min_observations, between(3, 30),
            {"of a track that is used once, in both cameras together"});
  f.boolean("window.first_estimates", o.window.first_estimates,
            {"Jacobians on a path that no update moves"});
}

void describeVision(Options& o, Config& c, Fields& f) {
  f.number("vision.sigma_px", o.vision.sigma_px, positive(), {"noise of a tracked point", "px"});
  f.number("vision.gate_probability", o.vision.gate_probability, between(0.5, 0.99999),
           {"of the χ² gates: the share of good points that pass"});
  f.number("vision.min_depth", o.vision.min_depth_m, positive(), {"of a point", "m"});
  f.number("vision.max_depth", o.vision.max_depth_m, positive(), {"of a point", "m"});
  f.number("vision.max_condition", o.vision.max_condition, positive(),
           {"of a triangulation's normal matrix"});
  f.number("vision.max_relative_sigma", o.vision.max_relative_sigma, positive(),
           {"of a triangulated depth"});
  f.boolean("calibration.estimate_extrinsics", o.calibration.estimate_extrinsics,
            {"camera-IMU extrinsics are part of the state"});
  f.boolean("calibration.estimate_time_offset", o.calibration.estimate_time_offset,
            {"the camera-IMU time offset is part of the state"});
  f.boolean("calibration.estimate_readout", o.calibration.estimate_readout,
            {"the read-out of a rolling shutter is part of the state; 0 in the rig stays 0"});
  f.number("calibration.gyro_scale", c.gyro_scale, between(0, 0.1),
           {"deviation of the gyroscope's scale on each axis, as its data sheet has it; 0: not "
            "estimated"});
  f.number("calibration.extrinsic_rotation", o.calibration.extrinsic_rotation, positive(),
           {"deviation of the given extrinsics", "rad"});
  f.number("calibration.extrinsic_position", o.calibration.extrinsic_position_m, positive(),
           {"deviation of the given extrinsics", "m"});
  f.number("calibration.second_camera_factor", o.calibration.second_camera_factor, positive(),
           {"on both, of the second camera relative to the first"});
  f.number("calibration.time_offset", o.calibration.time_offset_s, positive(),
           {"deviation of the given time offset", "s"});
  f.number("calibration.readout", o.calibration.readout_s, positive(),
           {"deviation of the given read-out of a rolling shutter", "s"});
}

void describeTracker(TrackerOptions& t, Config& c, Fields& f) {
  f.boolean("stereo.enabled", c.stereo, {"use the second camera where there is one"});
  f.number("stereo.pair_tolerance", c.pair_tolerance_s, positive(),
           {"stamps of a pair differ no more", "s"});
  f.integer("tracker.max_points", t.max_points, between(20, 1000), {"points in the first camera"});
  f.integer("tracker.grid_columns", t.grid_columns, between(1, 50), {"of new corners"});
  f.integer("tracker.grid_rows", t.grid_rows, between(1, 50), {"of new corners"});
  f.integer("tracker.pyramid_levels", t.pyramid_levels, between(1, 8),
            {"above the image itself, from image to image"});
  f.integer("tracker.stereo_levels", t.stereo_levels, between(0, 8),
            {"above the image itself, into the second camera"});
  f.integer("tracker.window", t.window_px, between(5, 51),
            {"side of a patch of Lucas-Kanade", "px"});
  f.integer("tracker.iterations", t.iterations, between(1, 100), {"of Lucas-Kanade"});
  f.integer("tracker.fast_threshold", t.fast_threshold, between(2, 100), {"of new corners"});
  f.number("tracker.min_distance", t.min_distance_px, atLeast(1), {"between corners", "px"});
  f.number("tracker.similarity", t.similarity, between(0, 1),
           {"of a patch with its first sight; a track that has less ends"});
  f.number("tracker.growth", t.growth, between(1.1, 10),
           {"of a patch since its first sight; grown more it is a new point"});
  f.number("tracker.ransac", t.ransac_px, positive(), {"from the epipolar line", "px"});
  f.number("tracker.stereo_epipolar", t.stereo_px, positive(),
           {"from the calibration's epipolar line, second camera", "px"});
}

void describeStart(Options& o, Fields& f) {
  f.number("start.rest_window", o.start.rest_window_s, positive(),
           {"a start at rest looks at so much time", "s"});
  f.number("start.rest_disparity", o.start.rest_disparity_px, positive(),
           {"more median image motion over that time is no rest", "px"});
  f.number("start.still_window", o.start.still_window_s, positive(),
           {"and at so much while most of the picture moves", "s"});
  f.number("start.rest_accel", o.start.rest_accel_m_s2, positive(),
           {"the mean force differs no more from gravity", "m/s²"});
  f.number("start.motion_window", o.start.motion_window_s, positive(),
           {"a start in motion looks at so much time, at most", "s"});
  f.number("start.tilt_sigma", o.start.tilt_sigma, positive(), {"at a start with speed", "rad"});
  f.number("start.gyro_bias_sigma", o.start.gyro_bias_sigma, positive(), {"in motion", "rad/s"});
  f.number("start.accel_bias_sigma", o.start.accel_bias_sigma, positive(),
           {"deviation of the accelerometer bias", "m/s²"});
  f.number("start.velocity_sigma", o.start.velocity_sigma, positive(),
           {"across the body, at a start with speed", "m/s"});
}

void describeAids(Options& o, Config& c, Fields& f) {
  f.boolean("rest.enabled", o.rest.enabled, {"zero-velocity updates"});
  f.number("rest.disparity", o.rest.disparity_px, positive(),
           {"less median image motion over rest.frames is rest", "px"});
  f.integer("rest.frames", o.rest.frames, between(1, 10), {"over which images must rest"});
  f.number("rest.speed_sigma", o.rest.speed_sigma, positive(),
           {"deviation of the velocity at rest", "m/s"});
  f.number("rest.position_sigma", o.rest.position_sigma_m, positive(),
           {"deviation between frames at rest", "m"});
  f.number("rest.rotation_sigma", o.rest.rotation_sigma, positive(),
           {"deviation between frames at rest", "rad"});
  f.number("rest.still_share", o.rest.still_share, between(0.05, 1),
           {"points that rest while the others move, at least, where a body stands in traffic"});
  f.number("rest.max_rate", o.rest.max_rate, positive(), {"turning faster is no rest", "rad/s"});
  f.number("rest.max_speed", o.rest.max_speed, positive(),
           {"a filter that believes to be faster does not rest", "m/s"});
  f.boolean("speed.enabled", o.speed.enabled, {"use the speed topic"});
  f.number("speed.sigma_factor", o.speed.sigma_factor, positive(), {"on the samples' own sigma"});
  f.number("speed.min_sigma", o.speed.min_sigma, positive(),
           {"deviation of a speed sample, at least", "m/s"});
  f.boolean("speed.planar", o.speed.planar,
            {"with each speed sample: no lateral and no vertical velocity of the body"});
  f.number("speed.lateral_sigma", o.speed.lateral_sigma, positive(),
           {"deviation of the lateral velocity from zero", "m/s"});
  f.number("speed.vertical_sigma", o.speed.vertical_sigma, positive(),
           {"deviation of the vertical velocity from zero", "m/s"});
  f.number("speed.max_age", o.speed.max_age_s, positive(),
           {"a sample is used for frames no further away", "s"});
  f.number("speed.wait", c.speed_wait_s, atLeast(0), {"a frame waits so long for a sample", "s"});
}

}  // namespace

void describe(Config& c, Fields& f) {
  f.number("gravity", c.core.gravity, between(9.7, 9.9), {"at the place of use", "m/s²"});
  describeImu(c.core, c, f);
  describeWindow(c.core, f);
  describeVision(c.core, c, f);
  describeTracker(c.tracker, c, f);
  describeStart(c.core, f);
  describeAids(c.core, c, f);
  f.texts("input.cameras", c.cameras, {"whose frames are read; the first one leads"});
  f.choice("input.odometry", c.odometry, {"estimated", "given"},
           {"given: another program publishes `odometry` for the frames; landmarks alone come from "
            "here"});
  f.integer("input.max_pending", c.max_pending, between(2, 1000),
            {"frames that may wait for their inertial samples, or for their poses"});
  f.boolean("input.moving_mask", c.moving_mask.enabled,
            {"reads `objects`, and puts no points on what moves"});
  f.number("input.moving_mask_from", c.moving_mask.probability, between(0.05, 1),
           {"probability of moving, and of existing, at least"});
  f.number("input.moving_mask_longest", c.moving_mask.longest_s, positive(),
           {"objects that are older are not believed", "s"});
  f.text("state.directory", c.state_directory,
         {"the state is kept here, each second, and resumed at a start; empty: nowhere", "",
          "give a folder that the service may write"});
  f.number("state.restore_age", c.restore_age_s, positive(),
           {"an older state is not resumed", "s"});
}

}  // namespace perdure::vio

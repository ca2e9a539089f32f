// A scene with exact truth: what stands where and when, how the body moves, and with which sensors
// it looks. A scene is a value made from (name, seed, options); the same three give the same scene.
// W has z up; the ground is z = 0.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/sim/trajectory.h"
#include "common/types/sensors.h"

namespace perdure::sim {

/// A thing that the map is to find (or to see through, as the toy): it is in the truth.
struct SceneObject {
  std::uint64_t id = 0;  ///< > 0
  std::string
      class_name;  ///< truth: car, van, person, bicycle, chair, dining table, monitor, couch, toy
  /// What a detector takes it for; the class itself but for the toy (a car).
  std::string looks_like;
  std::string
      shape;  ///< of the class (catalogue.h): hatchback, sedan, …; empty: by the look's seed
  std::uint64_t look_seed = 0;  ///< colours, textures, details
  Eigen::Vector3d size =
      Eigen::Vector3d::Ones();  ///< length (x of O), width (y), height (z); metres
  /// Centre of its box, yaw about +z. Object frame O: x forwards, z up, origin in the centre.
  Trajectory motion{RigidTransform{}};
  bool moves = false;  ///< ever, while it is present
  /// It moves at once, between two frames (someone moved it): the truth has two keys and no way
  /// between them. `moves` is set too.
  bool steps = false;
  double present_from_s = -1e9, present_until_s = 1e9;

  bool presentAt(double t_s) const { return t_s >= present_from_s && t_s < present_until_s; }
};

enum class PropKind { kFacade, kTree, kPole, kHedge, kWall, kKerb, kFloor, kCrate, kShelf };

/// Scenery: seen and able to hide things, but in no truth. Pose of its box's centre. Long things
/// (facades, walls, hedges, kerbs, shelves) have x along their length; their front is −y.
struct Prop {
  PropKind kind = PropKind::kFacade;
  std::uint64_t look_seed = 0;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  RigidTransform T_WP;
};

enum class GroundKind { kStreet, kRoom };
/// A stretch of road with pavements, for the ground's picture.
struct Road {
  Eigen::Vector2d from, to;
  double width_m = 7.0;
};

struct CameraErrors {
  double exposure_s = 0.008;      ///< motion blur over this time; stamps are its middle
  double noise_electrons = 12.0;  ///< read noise; shot noise follows from full_well
  double full_well_electrons = 10000.0;
  double vignetting = 0.15;  ///< darkening at the corner, share
  double gain_walk = 0.02;   ///< relative, 1/√s
};
struct ImuErrors {
  bool noise = true;  ///< white noise and bias walk by ImuCalibration's densities
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gyro_scale = Eigen::Matrix3d::Identity();  ///< scale and misalignment
  Eigen::Matrix3d accel_scale = Eigen::Matrix3d::Identity();
  double gyro_limit = 35.0, accel_limit = 160.0;  ///< saturation, rad/s and m/s²
};
struct SpeedErrors {
  double rate_hz = 50.0, sigma = 0.03, scale = 1.0;
  bool noise = true;
};

/// The sensors. `calibration` is what the sensor.yaml files say; `true_calibration` what the world
/// does (the same unless a test of calibration wants otherwise).
struct Rig {
  Calibration calibration, true_calibration;
  std::vector<CameraErrors> cameras;
  ImuErrors imu;
  std::optional<SpeedErrors> speed;
};

struct Scene {
  std::string name, proves;
  std::uint64_t seed = 0;
  double seconds = 0.0;  ///< how long the body's motion is worth watching
  Trajectory body{RigidTransform{}};
  Rig rig;
  std::vector<SceneObject> objects;
  std::vector<Prop> props;
  GroundKind ground = GroundKind::kStreet;
  std::vector<Road> roads;
  Eigen::Vector3d sun_W{0.4, 0.3, 0.87};  ///< unit vector towards it
  double sun_strength = 1.0, sky_strength = 0.5;
};

struct SceneOptions {
  std::optional<double> seconds;
  bool stereo = false, mono8 = false, rolling_shutter = false, noise = true;
  std::uint32_t width = 640, height = 480;
  double rate_hz = 20.0;
  /// Looks (colours, textures, shapes' details) come from seeds that differ between training,
  /// testing and use, so that a network is never tried on what it learnt.
  std::string look_set = "use";  ///< use, train, test
};

struct SceneName {
  std::string name, proves;
};
/// street, room, toy, occlusion, vanish, row, roll, still, straight, traffic, town, blocks, lap,
/// and `random`, single views for training.
const std::vector<SceneName>& sceneNames();
/// Throws StartupError(kUsage) with the known names.
Scene makeScene(const std::string& name, std::uint64_t seed, const SceneOptions& options);

}  // namespace perdure::sim

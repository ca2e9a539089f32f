// A scene with exact truth, determined by name, seed and options: objects with their motion, the
// motion of the body, and its sensors. W has z up and the ground at z = 0.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/sim/trajectory.h"
#include "common/types/sensors.h"

namespace perdure::sim {

/// An object of the truth, which the map should contain (or reject, if it is the toy).
struct SceneObject {
  std::uint64_t id = 0;  ///< > 0
  std::string
      class_name;  ///< truth: car, van, person, bicycle, chair, dining table, monitor, couch, toy
  /// The class that a detector assigns: the object's own class, except for the toy (car).
  std::string looks_like;
  std::string
      shape;  ///< shape of the class (catalogue.h): hatchback, sedan, …; empty: by the look's seed
  std::uint64_t look_seed = 0;  ///< colours, textures, details
  Eigen::Vector3d size =
      Eigen::Vector3d::Ones();  ///< length (x of O), width (y), height (z); metres
  /// Pose of the box centre, yaw about +z. Object frame O: x forwards, z up, origin in the centre.
  Trajectory motion{RigidTransform{}};
  bool moves = false;  ///< moves at some time during its presence
  /// The object jumps between two frames, as if moved by a person. The truth has two keys and no
  /// motion between them. `moves` is set too.
  bool steps = false;
  double present_from_s = -1e9, present_until_s = 1e9;

  bool presentAt(double t_s) const { return t_s >= present_from_s && t_s < present_until_s; }
};

enum class PropKind { kFacade, kTree, kPole, kHedge, kWall, kKerb, kFloor, kCrate, kShelf };

/// Scenery: visible and able to occlude objects, but not part of the truth. The pose is that of the
/// box centre. Long props (facades, walls, hedges, kerbs, shelves) extend along x; their front is
/// −y.
struct Prop {
  PropKind kind = PropKind::kFacade;
  std::uint64_t look_seed = 0;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  RigidTransform T_WP;
};

enum class GroundKind { kStreet, kRoom };
struct Road {
  Eigen::Vector2d from, to;
  double width_m = 7.0;
};

struct CameraErrors {
  double exposure_s = 0.008;      ///< motion blur over this time; the stamp is its middle
  double noise_electrons = 12.0;  ///< read noise; shot noise follows from full_well
  double full_well_electrons = 10000.0;
  double vignetting = 0.15;  ///< darkening at the corner, as a share
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

/// The sensors. `calibration` is written to the sensor.yaml files; `true_calibration` is that of
/// the simulated sensors. Only tests of calibration have different values.
struct Rig {
  Calibration calibration, true_calibration;
  std::vector<CameraErrors> cameras;
  ImuErrors imu;
  std::optional<SpeedErrors> speed;
};

struct Scene {
  std::string name, proves;
  std::uint64_t seed = 0;
  double seconds = 0.0;  ///< useful duration of the body's motion
  Trajectory body{RigidTransform{}};
  Rig rig;
  std::vector<SceneObject> objects;
  std::vector<Prop> props;
  GroundKind ground = GroundKind::kStreet;
  std::vector<Road> roads;
  Eigen::Vector3d sun_W{0.4, 0.3, 0.87};  ///< unit vector towards the sun
  double sun_strength = 1.0, sky_strength = 0.5;
};

struct SceneOptions {
  std::optional<double> seconds;
  bool stereo = false, mono8 = false, rolling_shutter = false, noise = true;
  std::uint32_t width = 640, height = 480;
  double rate_hz = 20.0;
  /// Looks (colours, textures, shapes) have different seeds for training, testing and use, so that
  /// no network is tested on its training data.
  std::string look_set = "use";  ///< use, train, test
};

struct SceneName {
  std::string name, proves;
};
/// All scenes, including `random`: single views for training.
const std::vector<SceneName>& sceneNames();
/// Builds a scene. Throws StartupError(kUsage) with the known names if `name` is unknown.
Scene makeScene(const std::string& name, std::uint64_t seed, const SceneOptions& options);

}  // namespace perdure::sim

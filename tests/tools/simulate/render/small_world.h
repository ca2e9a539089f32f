// A few objects before a camera at rest, placed by hand, so that the expected images are simple.
#pragma once

#include "common/sim/scene.h"
#include "tests/support/camera.h"

namespace perdure::tools {

/// A world without objects. The camera looks along +x of W from (0, 0, 1.2); 80° wide, distorted.
inline sim::Scene emptyWorld(std::uint32_t width = 160, std::uint32_t height = 120) {
  sim::Scene scene;
  scene.name = "by hand";
  scene.seconds = 1.0;
  scene.body = sim::Trajectory(
      RigidTransform(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(0, 0, 1.2)));
  scene.roads = {{{-20.0, 0.0}, {60.0, 0.0}, 7.0}};
  CameraCalibration camera = tests::cameraAhead(width, height, 0.6 * width);
  camera.cx -= 0.5, camera.cy -= 0.5;
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients = {-0.1, 0.01, 1e-3, -1e-3};
  camera.rate_hz = 10.0;
  scene.rig.true_calibration.cameras = {camera};
  scene.rig.calibration = scene.rig.true_calibration;
  scene.rig.cameras.resize(1);
  return scene;
}

inline sim::SceneObject thing(std::uint64_t id, const std::string& class_name,
                              const Eigen::Vector3d& size, const Eigen::Vector3d& centre) {
  sim::SceneObject object;
  object.id = id;
  object.class_name = object.looks_like = class_name;
  object.look_seed = 7 + id;
  object.size = size;
  object.motion =
      sim::Trajectory(RigidTransform(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), centre));
  return object;
}

inline sim::Prop wall(const Eigen::Vector3d& size, const Eigen::Vector3d& centre) {
  sim::Prop prop;
  prop.kind = sim::PropKind::kCrate;
  prop.size = size;
  prop.T_WP = RigidTransform(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), centre);
  return prop;
}

}  // namespace perdure::tools

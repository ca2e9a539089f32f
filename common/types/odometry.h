// The output of vio: the pose of the body, its covariance, and the sparse attributed points (eq. 3,
// 5).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/math/rigid_transform.h"
#include "common/types/description.h"

namespace perdure {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

enum class OdometryState : std::uint8_t {
  kInitialising = 0,  ///< not usable yet
  kTracking = 1,
  kDegraded = 2,  ///< usable, based on inertial or speed data alone, or just resumed
};

struct Odometry {
  FrameStamp stamp;
  InstanceId instance = 0;  ///< the process that published it
  WorldId world;
  OdometryState state = OdometryState::kInitialising;
  RigidTransform T_WB;
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s, in W
  /// Covariance of [θ, p, v]: θ on the right (body), p and v additive in W.
  Matrix9d covariance = Matrix9d::Zero();
  Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();  ///< unit vector against gravity, in W
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  /// Pose error now = transition · pose error at the frame `increment_from` + noise with
  /// increment_covariance, [θ, p]. has_increment is false if only poses are known.
  bool has_increment = false;
  std::uint64_t increment_from = 0;
  Matrix6d transition = Matrix6d::Identity();
  Matrix6d increment_covariance = Matrix6d::Zero();
};

/// A sparse point with the data needed to recognise it again (paper, line 131).
struct Landmark {
  std::uint64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m², in W, relative to the pose
  Eigen::Matrix<double, 3, 6> cross_pose = Eigen::Matrix<double, 3, 6>::Zero();  ///< with [θ, p]
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< distorted pixel in `camera`
  std::array<std::uint8_t, 32> descriptor{};        ///< 256-bit BRIEF (ORB), or zeros
};

struct Landmarks {
  FrameStamp stamp;
  InstanceId instance = 0;
  WorldId world;
  std::string camera;
  std::vector<Landmark> landmarks;
};

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<Odometry> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.choice("state", d.state, w.state, OdometryState::kDegraded);
  a.pose("T_WB", d.T_WB, w.T_WB);
  a.matrix("v_WB", d.v_WB, w.v_WB, kSpeed);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.unit("up_W", d.up_W, w.up_W);
  a.matrix("gyro_bias", d.gyro_bias, w.gyro_bias, kAngularRate);
  a.matrix("accel_bias", d.accel_bias, w.accel_bias, kAcceleration);
  a.value("has_increment", d.has_increment, w.has_increment);
  a.value("increment_from", d.increment_from, w.increment_from);
  a.matrix("transition", d.transition, w.transition, kMatrixEntry);
  a.symmetric("increment_covariance", d.increment_covariance, w.increment_covariance);
}

void describe(auto& a, Is<Landmark> auto& d, auto& w) {
  a.value("id", d.id, w.landmark_id);
  a.matrix("p_W", d.p_W, w.p_W, kCoordinate);
  a.symmetric("covariance", d.covariance, w.covariance);
  a.matrix("cross_pose", d.cross_pose, w.cross_pose, kMatrixEntry);
  a.matrix("pixel", d.pixel, w.pixel, kPixel);
  a.bytes("descriptor", d.descriptor, w.descriptor);
}

void describe(auto& a, Is<Landmarks> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.value("instance", d.instance, w.source);
  a.object("world", d.world, w.reference);
  a.name("camera", d.camera, w.camera);
  a.list("landmarks", d.landmarks, w.items, kLandmarks);
}

}  // namespace perdure::wire

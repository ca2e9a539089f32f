// ROS' sensors as Perdure's and back: inertial samples, lenses, and where frames lie to each other.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/math/rigid_transform.h"
#include "common/ros/messages.h"
#include "common/types/sensors.h"

namespace perdure::ros {

TimePoint timeOf(const Time& time);
/// Source and sequence are the caller's.
ImuSample sampleOf(const Imu& imu);
/// Size and lens of the images that the message is about: by K and D as they come, by P where they
/// are `rectified` already; binning and region are taken into account. Neither name nor place nor
/// rate. Reasons: "not_finite" (a number that is none, infinity), "uncalibrated" (no focal length),
/// "lens" (a model or a number of coefficients that is not known), with a sentence.
Result<CameraCalibration> cameraOf(const CameraInfo& info, bool rectified);

/// In the frame imu_link, without an orientation; `noise` gives the covariances.
Imu imuOf(const ImuSample& sample, const ImuCalibration* noise);
CameraInfo infoOf(const CameraCalibration& camera, TimePoint time);

RigidTransform transformOf(const Transform& transform);
/// "/base_link", as ROS 1 may say, is "base_link".
std::string frameName(const std::string& frame_id);

/// What is known of how frames lie to each other.
class FrameTree {
 public:
  void add(const TFMessage& message);
  bool empty() const { return parents_.empty(); }
  /// Of transforms that are none, the last of each child: what is wrong with it, for people.
  const std::map<std::string, std::string>& refused() const { return refused_; }
  /// T_to_from: points of `from` into `to`; nothing where no way leads from one to the other.
  std::optional<RigidTransform> find(const std::string& to, const std::string& from) const;

 private:
  struct Edge {
    std::string parent;
    RigidTransform T_parent_child;
  };
  std::map<std::string, RigidTransform> toRoots(std::string frame) const;

  std::map<std::string, Edge> parents_;  ///< by child
  std::map<std::string, std::string> refused_;
};

}  // namespace perdure::ros

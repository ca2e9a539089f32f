// Converts ROS sensor messages to Perdure's and back: inertial samples, lenses, and transforms
// between frames.
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
/// Converts an inertial sample. The caller sets source and sequence.
ImuSample sampleOf(const Imu& imu);
/// Size and lens of the images that the message describes: from K and D, or from P if they are
/// `rectified`. Binning and region of interest are applied. Name, pose and rate are not set.
/// Reasons: "not_finite" (NaN or infinity), "uncalibrated" (no focal length), "lens" (unknown model
/// or number of coefficients), with a sentence.
Result<CameraCalibration> cameraOf(const CameraInfo& info, bool rectified);

/// The message in the frame imu_link, without orientation. The covariances come from `noise`.
Imu imuOf(const ImuSample& sample, const ImuCalibration* noise);
CameraInfo infoOf(const CameraCalibration& camera, TimePoint time);

RigidTransform transformOf(const Transform& transform);
/// Removes the leading slash that ROS 1 allows: "/base_link" becomes "base_link".
std::string frameName(const std::string& frame_id);

/// The known transforms between frames.
class FrameTree {
 public:
  void add(const TFMessage& message);
  bool empty() const { return parents_.empty(); }
  /// Invalid transforms: the last error of each child frame, as text for users.
  const std::map<std::string, std::string>& refused() const { return refused_; }
  /// T_to_from: points of `from` into `to`. Returns nothing if the two frames are not connected.
  std::optional<RigidTransform> find(const std::string& to, const std::string& from) const;

 private:
  struct Edge {
    std::string parent;
    RigidTransform T_parent_child;
  };
  std::map<std::string, RigidTransform> toRoots(std::string frame) const;

  std::map<std::string, Edge> parents_;  ///< key: child frame
  std::map<std::string, std::string> refused_;
};

}  // namespace perdure::ros

// A camera at the origin of W that looks along x, and objects before it.
#pragma once

#include <cmath>

#include "common/types/sensors.h"
#include "tests/support/camera.h"
#include "tools/outputs/pictures/drive_log.h"

namespace perdure::tools {

inline CameraCalibration aheadCamera() {
  CameraCalibration camera = tests::cameraAhead(640, 480, 500);
  camera.rate_hz = 10;
  return camera;
}

inline ObjectGlance objectAt(ObjectId id, const Eigen::Vector3d& p_W,
                             Visibility visibility = Visibility::kVisible,
                             const std::string& class_name = "car") {
  ObjectGlance object;
  object.id = id;
  object.class_name = class_name;
  object.existence = 0.9;
  object.confirmed = true;
  object.visibility = visibility;
  object.p_W = p_W;
  object.p_covariance = 0.01 * Eigen::Matrix3d::Identity();
  object.size = {4.0, 2.0, 1.5};
  return object;
}

inline FrameGlance frameOf(std::uint64_t index, std::vector<ObjectGlance> objects) {
  FrameGlance frame;
  frame.stamp.sequence = index;
  frame.stamp.time = fromNanoseconds(static_cast<std::int64_t>(index) * 100'000'000);
  frame.has_objects = true;
  frame.objects = std::move(objects);
  return frame;
}

inline ObjectBelief beliefOf(const ObjectGlance& glance) {
  ObjectBelief object;
  object.id = glance.id;
  object.existence = glance.existence;
  object.confirmed = glance.confirmed;
  object.visibility = glance.visibility;
  ClassBelief best;
  best.name = glance.class_name;
  best.probability = 1.0;
  best.mean << glance.p_W, glance.yaw, glance.size.array().log().matrix();
  best.covariance.setZero();
  best.covariance.topLeftCorner<3, 3>() = glance.p_covariance;
  object.classes.push_back(best);
  return object;
}

inline Objects messageOf(const FrameGlance& frame) {
  Objects message;
  message.stamp = frame.stamp;
  message.T_WB = frame.T_WB;
  for (const auto& object : frame.objects) message.objects.push_back(beliefOf(object));
  return message;
}

}  // namespace perdure::tools

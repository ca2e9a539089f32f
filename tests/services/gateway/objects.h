// Objects, events and a camera for the gateway's tests.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "common/types/objects.h"
#include "common/types/sensors.h"

namespace perdure::gateway::test {

inline ObjectBelief objectAt(ObjectId id, const Eigen::Vector3d& p,
                             const std::string& name = "car") {
  ObjectBelief object;
  object.id = id;
  object.existence = 0.97;
  object.confirmed = true;
  object.classes.resize(2);
  object.classes[0].name = name;
  object.classes[0].probability = 0.9;
  object.classes[1].name = kOtherClass;
  object.classes[1].probability = 0.1;
  for (ClassBelief& belief : object.classes) {
    belief.mean << p, 0.5, std::log(4.0), std::log(1.8), std::log(1.5);
    belief.covariance = 0.04 * Matrix7d::Identity();
  }
  object.first_seen = fromNanoseconds(1'000'000'000);
  object.last_seen = fromNanoseconds(2'000'000'000);
  object.hits = 7;
  object.visible_fraction = 1;
  object.why.existence.resize(kExistenceEvidences);
  object.why.existence[0] = {-1.5, 1, object.first_seen, object.first_seen};
  object.why.existence[1] = {5.0, 7, object.first_seen, object.last_seen};
  object.why.classes = {{name, {-0.25, 0.15}}, {kOtherClass, {std::log(0.1)}}};
  return object;
}

inline Objects frameOf(std::uint64_t sequence, std::vector<ObjectBelief> objects) {
  Objects frame;
  frame.stamp = {42, sequence,
                 fromNanoseconds(2'000'000'000 + 100'000'000 * static_cast<std::int64_t>(sequence)),
                 1};
  frame.world = {77, 1};
  frame.objects = std::move(objects);
  return frame;
}

inline Event eventOf(EventKind kind, ObjectId id) {
  Event event;
  event.stamp = {42, 5, fromNanoseconds(2'500'000'000), 0};
  event.kind = kind;
  event.object_id = id;
  event.class_name = "car";
  event.probability = 0.8;
  return event;
}

inline Detection detectionOf(const Box& box, std::vector<float> activations) {
  Detection detection;
  detection.box = box;
  detection.activations = std::move(activations);
  return detection;
}

/// Looks along the body's x axis from its origin.
inline Calibration forwardCamera() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 400;
  camera.cx = 320;
  camera.cy = 240;
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_BC = RigidTransform(R_BC, Eigen::Vector3d::Zero());
  Calibration calibration;
  calibration.cameras = {camera};
  return calibration;
}

}  // namespace perdure::gateway::test

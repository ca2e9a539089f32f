// Objects, events and a camera for the gateway's tests.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "common/types/map.h"
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

/// The object as map_store lists it.
inline MapObject rowOf(const ObjectBelief& belief) {
  MapObject row;
  row.id = belief.id;
  row.class_name = belief.best().name;
  row.existence = belief.existence;
  row.class_probability = belief.best().probability;
  row.mean = belief.best().mean;
  row.first_seen = belief.first_seen;
  row.last_seen = belief.last_seen;
  return row;
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

/// A camera at the body's origin that looks along its x axis.
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

/// Returns three anchors 100 m to the left of the trajectory, with a loop of each display style
/// between them.
inline MapReply graphFor(const MapQuery& query, const WorldId& map) {
  MapReply reply;
  reply.client = query.client;
  reply.request = query.request;
  for (AnchorNumber id = 1; id <= 3; ++id) {
    MapAnchor anchor;
    anchor.id = id;
    anchor.previous = id - 1;
    anchor.session = anchor.map = map;
    anchor.p = {10.0 * static_cast<double>(id - 1), id == 3 ? 101.0 : 100.0, 0.0};
    if (id == 2) anchor.sigma << 0.2, 0.1, 0.05, 0.01;  // the third anchor has no covariance
    anchor.objects = 2;
    reply.anchors.push_back(anchor);
  }
  const auto add = [&](std::uint64_t id, AnchorNumber a, AnchorNumber b, MapLoopState state) {
    MapLoop loop;
    loop.id = id;
    loop.a = a;
    loop.b = b;
    loop.state = state;
    loop.residual << 0.12, -0.03, 0.01, 0.002;
    loop.sigma << 0.1, 0.1, 0.05, 0.004;
    loop.chi2 = 1.75;
    loop.weight = state == MapLoopState::kConfirmed ? 1.0 : 0.2;
    loop.pairs = {{1, 1}, {2, 77}};
    reply.loops.push_back(loop);
  };
  add(1, 1, 3, MapLoopState::kConfirmed);
  add(2, 1, 2, MapLoopState::kTentative);
  add(3, 2, 3, MapLoopState::kWithdrawn);
  add(4, 1, 3, MapLoopState::kConfirmed);
  reply.loops.back().kind = MapLoopKind::kTie;
  reply.loops.back().pairs.clear();
  reply.loops.back().sigma.setZero();
  reply.anchor_count = 3;
  reply.loop_count = 4;
  return reply;
}

}  // namespace perdure::gateway::test

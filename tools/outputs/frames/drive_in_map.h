// Poses and edges of a run in M, the frame of its map. The pictures and map.geojson use them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "common/base/ids.h"
#include "common/math/rigid_transform.h"
#include "common/replay/files/pose_file.h"

namespace perdure::tools {

/// A loop or tracking edge of the map's graph, between two positions in M.
struct LoopLine {
  Eigen::Vector3d a_M = Eigen::Vector3d::Zero(), b_M = Eigen::Vector3d::Zero();
  bool believed = true;
};

struct DriveInMap {
  /// T_MW at each anchor of the session, from the final graph. Empty if M is W.
  std::vector<std::pair<TimePoint, RigidTransform>> along;
  /// T_MW for the last belief of each object; objects without an entry use `along`.
  std::map<ObjectId, RigidTransform> objects;
  std::vector<Eigen::Vector3d> anchors_M;
  std::vector<LoopLine> loops;
  /// The body's position at each frame as the map estimated it at that time, in the axes of the
  /// session's start.
  std::map<std::uint64_t, Eigen::Vector3d> then;

  /// Pose of the body in M; T_MW is interpolated between anchors.
  RigidTransform T_MB(const replay::StampedPose& pose) const;
  /// T_MW at the last anchor until `time`, or at the first anchor if there is none until then.
  RigidTransform T_MW(TimePoint time) const;
  RigidTransform T_MW_begin() const;
};

}  // namespace perdure::tools

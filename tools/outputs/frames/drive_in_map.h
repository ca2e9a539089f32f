// How a run lies in M, the frame in which its map is one, for the pictures and map.geojson.
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

/// A loop or tracking edge of the map's graph, between two places in M.
struct LoopLine {
  Eigen::Vector3d a_M = Eigen::Vector3d::Zero(), b_M = Eigen::Vector3d::Zero();
  bool believed = true;
};

struct DriveInMap {
  /// T_MW beside each anchor of the session, by time, as the graph has it in the end. Empty: the
  /// run has no graph, and M is W.
  std::vector<std::pair<TimePoint, RigidTransform>> along;
  /// T_MW for the last belief of each object; what is missing is laid by `along`.
  std::map<ObjectId, RigidTransform> objects;
  std::vector<Eigen::Vector3d> anchors_M;
  std::vector<LoopLine> loops;
  /// The body by frame where the map had it at that time, in the axes in which the session began.
  std::map<std::uint64_t, Eigen::Vector3d> then;

  /// The body in M; between anchors T_MW is interpolated.
  RigidTransform T_MB(const replay::StampedPose& pose) const;
  /// T_MW at the last anchor until a time, or the first one.
  RigidTransform T_MW(TimePoint time) const;
  /// T_MW where the session began.
  RigidTransform T_MW_begin() const;
};

}  // namespace perdure::tools

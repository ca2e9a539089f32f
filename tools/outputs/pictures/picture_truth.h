// Ground truth for the pictures, in W or M, sorted by time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/math/rigid_transform.h"

namespace perdure::tools {

struct TruthTrack {
  struct Key {
    TimePoint time;
    Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
    double yaw = 0.0;
  };
  std::uint64_t id = 0;
  std::string class_name;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< length, width, height
  bool moves = false;
  std::vector<Key> keys;  ///< never empty; sorted by time
  TimePoint present_from = TimePoint::min(), present_until = TimePoint::max();

  /// State at `time`. For static objects, the last key until then, or the first key if there is
  /// none. For moving objects, interpolated linearly between keys. Empty while the object is
  /// absent, and outside the keys of moving objects.
  std::optional<Key> at(TimePoint time) const;
};

struct PictureTruth {
  std::map<std::uint64_t, Eigen::Vector3d> path;  ///< trajectory by frame; may be empty
  std::vector<TruthTrack> objects;
};

/// Transforms ground truth from frame B to frame A; both are gravity-levelled.
PictureTruth turned(const RigidTransform& T_AB, PictureTruth truth);

}  // namespace perdure::tools

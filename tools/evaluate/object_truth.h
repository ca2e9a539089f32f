// Selects the true objects that count in a frame, and those that are ignored.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/replay/files/kitti_labels.h"

namespace perdure::tools {

/// A true object in one frame, in the reference frame of the comparison.
struct TruthLabel {
  std::int64_t track = -1;
  std::string class_name;  ///< class that an estimate must have; empty: any
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double heading = 0;  ///< radians, about the vertical
  Box box;             ///< outline in the image
};

/// Truth of one frame. KITTI: rectified camera 0, boxes in image 2, heading `rotation_y`.
struct TruthFrame {
  std::vector<TruthLabel> counted;
  std::vector<TruthLabel> ignored;  ///< other labels
  std::vector<Box> dont_care;       ///< regions without 3D
};

inline constexpr double kMinHeight_px = 25.0;  ///< least height of a counted box

using PosesByFrame = std::map<std::uint64_t, RigidTransform>;  ///< T_WB

/// Returns the tracks that are static in the world: the medians of their first and last fifth are
/// less than 1.5 m apart, and no point is more than 2 m from the overall median. Omits frames
/// without a pose; a track without any pose is not static.
std::set<std::int64_t> staticTracks(const std::vector<replay::KittiLabel>& labels,
                                    const RigidTransform& T_RI, const PosesByFrame& poses);

/// Sorts labels into counted and ignored ones. A label counts if it is a `Car` of a static track,
/// not occluded, not truncated, and at least 25 px tall.
std::map<std::uint64_t, TruthFrame> sortTruth(const std::vector<replay::KittiLabel>& labels,
                                              const std::set<std::int64_t>& static_tracks);

}  // namespace perdure::tools

// Which true objects count in a frame, and which are ignored.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"

namespace perdure::tools {

/// A true object in one frame, in the frame of reference in which estimates are compared with it.
struct TruthLabel {
  std::int64_t track = -1;
  std::string class_name;  ///< that an estimate must have; empty: estimates are not asked
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double heading = 0;  ///< radians, about the vertical
  Box box;             ///< in the image
};

/// Truth of one frame. Of KITTI: all in rectified camera 0, boxes in image 2, heading `rotation_y`.
struct TruthFrame {
  std::vector<TruthLabel> counted;
  std::vector<TruthLabel> ignored;  ///< other labels
  std::vector<Box> dont_care;       ///< regions without 3D
};

inline constexpr double kMinHeight_px = 25.0;  ///< of what counts

using PosesByFrame = std::map<std::uint64_t, RigidTransform>;  ///< T_WB

/// Tracks that stand still in the world: the median of the first fifth and of the last fifth of
/// the track less than 1.5 m apart, and no point more than 2 m from the median of all. Frames
/// without a pose are left out; a track without any is not static.
std::set<std::int64_t> staticTracks(const std::vector<replay::KittiLabel>& labels,
                                    const RigidTransform& T_RI, const PosesByFrame& poses);

/// Counted: `Car`, occluded 0, truncated 0, at least 25 px tall, of a static track.
std::map<std::uint64_t, TruthFrame> sortTruth(const std::vector<replay::KittiLabel>& labels,
                                              const std::set<std::int64_t>& static_tracks);

}  // namespace perdure::tools

// Which labelled cars count, and which labels are ignored (design, section 7).
#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/replay/kitti_calibration.h"
#include "common/replay/kitti_labels.h"

namespace perdure::tools {

/// Labels of one frame; all in rectified camera 0, boxes in image 2.
struct TruthFrame {
  std::vector<replay::KittiLabel> counted;
  std::vector<replay::KittiLabel> ignored;    ///< other labels
  std::vector<replay::KittiLabel> dont_care;  ///< regions without 3D
};

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

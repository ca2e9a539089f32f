// The pictures' truth from what a dataset has of it: a simulated folder's own, or KITTI's labels.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>

#include "common/replay/dataset.h"
#include "common/replay/files/kitti_labels.h"
#include "common/sim/truth.h"
#include "tools/outputs/pictures/picture_truth.h"

namespace perdure::tools {

using StampedPoses = std::map<std::uint64_t, replay::StampedPose>;  ///< T_WB, by frame

/// Truth has a world of its own: it is laid into W, by yaw and position, so that the body stands
/// where it is estimated at the first of `poses` for which its true pose is known. Empty where
/// there is none.
PictureTruth truthOfSimulation(const sim::Truth& truth, const replay::PoseFile& body,
                               const StampedPoses& poses);

/// Labels are seen from the body, so that they stand in W by `poses`. T_RI: the body in rectified
/// camera 0. A track that stands still is one box, at the middle of its positions.
PictureTruth truthOfLabels(const std::vector<replay::KittiLabel>& labels,
                           const RigidTransform& T_RI, const StampedPoses& poses);

/// Whichever the folder has; nothing where it has neither, or where its truth cannot be read (that
/// is said where the truth is scored).
std::optional<PictureTruth> pictureTruth(const replay::Dataset& dataset,
                                         const replay::DatasetOptions& data,
                                         const StampedPoses& poses);

/// The same from files of KITTI tracking that belong to the drive.
std::optional<PictureTruth> pictureTruthOfLabels(const std::filesystem::path& labels,
                                                 const std::filesystem::path& calibration,
                                                 const StampedPoses& poses);

}  // namespace perdure::tools

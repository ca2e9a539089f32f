// Loads ground truth for the pictures: from a simulated folder, or from the labels of KITTI.
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

/// Aligns the world of ground truth with W by yaw and position, at the first of `poses` with a
/// known true pose. Returns empty ground truth if there is no such pose.
PictureTruth truthOfSimulation(const sim::Truth& truth, const replay::PoseFile& body,
                               const StampedPoses& poses);

/// Transforms labels, which are relative to the body, to W by `poses`. T_RI maps points of the body
/// to rectified camera 0. A static track becomes one box at the median of its positions.
PictureTruth truthOfLabels(const std::vector<replay::KittiLabel>& labels,
                           const RigidTransform& T_RI, const StampedPoses& poses);

/// Loads the truth of a dataset folder. Empty if the truth is missing or invalid; the scoring
/// reports the latter.
std::optional<PictureTruth> pictureTruth(const replay::Dataset& dataset,
                                         const replay::DatasetOptions& data,
                                         const StampedPoses& poses);

/// Reads truth from the files of KITTI tracking that belong to the drive.
std::optional<PictureTruth> pictureTruthOfLabels(const std::filesystem::path& labels,
                                                 const std::filesystem::path& calibration,
                                                 const StampedPoses& poses);

}  // namespace perdure::tools

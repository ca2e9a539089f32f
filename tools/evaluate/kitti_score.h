// Scores objects against KITTI tracking labels, in rectified camera 0.
#pragma once

#include <optional>

#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// A row in the camera; empty if its centre is behind it or outside the image.
std::optional<Estimate> toCamera(const EstimateRow& row, const RigidTransform& T_RW,
                                 const replay::KittiCalibration& calibration);

ObjectScore scoreObjects(const std::vector<EstimateRow>& rows,
                         const std::map<std::uint64_t, TruthFrame>& truth,
                         const PosesByFrame& poses, const replay::KittiCalibration& calibration,
                         const ScoreOptions& options);

}  // namespace perdure::tools

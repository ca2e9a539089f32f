// Scores objects against the labels of KITTI tracking; estimates are transformed to rectified
// camera 0.
#pragma once

#include <optional>

#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/object_score.h"

namespace perdure::tools {

/// Transforms a row from W to the camera. Empty if the centre is behind the camera or outside the
/// image.
std::optional<Estimate> toCamera(const EstimateRow& row, const RigidTransform& T_RW,
                                 const replay::KittiCalibration& calibration);

ObjectScore scoreObjects(const std::vector<EstimateRow>& rows,
                         const std::map<std::uint64_t, TruthFrame>& truth,
                         const PosesByFrame& poses, const replay::KittiCalibration& calibration,
                         const ScoreOptions& options);

}  // namespace perdure::tools

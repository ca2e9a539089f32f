// A simulated folder as truth: exact states, and the visible share of each object.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/replay/files/pose_file.h"
#include "common/sim/truth.h"
#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/object_score.h"

namespace perdure::tools {

struct SimulatedTruth {
  sim::Truth truth;
  replay::PoseFile body{replay::PoseFormat::kTum, {}};  ///< T_WB by time, W of the ground truth
  CameraModel camera;
  std::vector<TimePoint> frames;  ///< times of cam0, by index

  double frameInterval() const;  ///< mean in seconds; 0.1 if there are fewer than two frames
};

bool isSimulated(const std::filesystem::path& folder);
/// Throws StartupError(kUnavailable) with the missing file and the fix.
SimulatedTruth readSimulatedTruth(const std::filesystem::path& folder);

/// Frames up to the last one of the trajectory, in the camera frame, headings relative to the body.
/// Counted: static objects of `class_name` (empty: all but `toy`), nine tenths visible, completely
/// in the image, at least 25 px tall; others are ignored, except toys. Rows of `other` or another
/// class are omitted.
struct SimulatedRun {
  std::map<std::uint64_t, ScoredFrame> frames;
  std::uint64_t estimates = 0;  ///< number of examined rows
  std::uint64_t outside = 0;    ///< part of these: centre outside the image, or no pose
  std::uint64_t poses = 0;      ///< frames with a pose
};
SimulatedRun pairWithTruth(const SimulatedTruth& truth, const std::vector<EstimateRow>& rows,
                           const std::vector<replay::StampedPose>& trajectory,
                           const std::string& class_name);

}  // namespace perdure::tools

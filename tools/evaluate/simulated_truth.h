// A simulated folder as truth for objects: the exact states of body and objects, and how much of
// each is seen in each frame (the folder's files in place of labels).
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
  replay::PoseFile body{replay::PoseFormat::kTum, {}};  ///< T_WB by time, W of the truth
  CameraModel camera;
  std::vector<TimePoint> frames;  ///< of cam0, by index

  double frameInterval() const;  ///< seconds, the mean; 0.1 where there are fewer than two frames
};

bool isSimulated(const std::filesystem::path& folder);
/// Throws StartupError(kUnavailable) with what is missing and the mend.
SimulatedTruth readSimulatedTruth(const std::filesystem::path& folder);

/// Frames up to the trajectory's last, each in the camera: the truth through the exact state, the
/// rows through the trajectory, headings about the vertical against the body's.
///
/// Counted: an object of any class but `toy` (of `class_name`, where given) that never moves, at
/// least nine tenths of it in sight, its whole outline inside the image, at least 25 px tall. The
/// others are ignored, but for toys: whatever is claimed where a toy is, is a false alarm. Rows of
/// class `other` claim no class and are left out; so are rows of other classes than `class_name`.
struct SimulatedRun {
  std::map<std::uint64_t, ScoredFrame> frames;
  std::uint64_t estimates = 0;  ///< rows that were looked at
  std::uint64_t outside = 0;    ///< of these, centre not in the image or frame without a pose
  std::uint64_t poses = 0;      ///< frames with a pose
};
SimulatedRun pairWithTruth(const SimulatedTruth& truth, const std::vector<EstimateRow>& rows,
                           const std::vector<replay::StampedPose>& trajectory,
                           const std::string& class_name);

}  // namespace perdure::tools

// Reads the truth of a simulated folder: exact states, and the visible share of each object.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/replay/dataset.h"
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

  double frameInterval() const;  ///< mean, seconds; 0.1 if there are fewer than two frames
};

bool isSimulated(const std::filesystem::path& folder);
/// Returns a sentence with the file of the truth that a simulated folder lacks, or "".
std::string lackOfTruth(const std::filesystem::path& folder, const replay::Dataset& dataset);
/// Throws StartupError(kUnavailable) with the missing file and the fix if the folder is incomplete.
SimulatedTruth readSimulatedTruth(const std::filesystem::path& folder);

/// The frames up to the last pose of the trajectory, in the camera frame. The exact states
/// transform the ground truth; the trajectory transforms the rows. Headings are about the vertical,
/// relative to the body.
///
/// Counted objects have any class except `toy` (or `class_name`, if given) and never move. They are
/// at least nine tenths visible, completely in the image, and at least 25 px tall. Other objects
/// are ignored, except toys: an estimate at a toy is a false alarm. Rows of class `other` state no
/// class and are omitted, as are rows of classes other than `class_name`.
struct SimulatedRun {
  std::map<std::uint64_t, ScoredFrame> frames;
  std::uint64_t estimates = 0;  ///< number of examined rows
  std::uint64_t outside = 0;    ///< of these: centre outside the image, or no pose
  std::uint64_t poses = 0;      ///< frames with a pose
};
SimulatedRun pairWithTruth(const SimulatedTruth& truth, const std::vector<EstimateRow>& rows,
                           const std::vector<replay::StampedPose>& trajectory,
                           const std::string& class_name);

}  // namespace perdure::tools

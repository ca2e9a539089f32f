// Precision, recall and identity errors of objects against truth (Table 1 of the paper).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/files/kitti_calibration.h"
#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/object_truth.h"

namespace perdure::tools {

inline constexpr std::array<double, 3> kDistances_m{0.5, 1.0, 1.5};
inline constexpr std::array<double, 3> kAngles_deg{30.0, 45.0, 180.0};  ///< last value: any angle

struct Cell {
  std::uint64_t matched = 0, truth = 0, false_alarms = 0;
  double distance_m = 0.0;       ///< sum over the matches
  double recall() const;         ///< 1 if there is no ground truth
  double precision() const;      ///< 1 if there are no estimates
  double positionError() const;  ///< metres, mean over the matches
};

/// A false alarm (`id` is the estimate's) or a miss (`id` is the true track), within 1.5 m at any
/// angle.
struct Mishap {
  std::uint64_t frame = 0;
  bool miss = false;
  std::int64_t id = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< position in the camera frame
  double nearest_m =
      0.0;  ///< distance to the nearest estimate (a miss) or any label (a false alarm)
};

struct ObjectScore {
  std::array<std::array<Cell, 3>, 3> cells{};  ///< indices [distance][angle]
  // Within 1.5 m, any orientation:
  std::uint64_t id_switches = 0;    ///< matches whose id differs from the object's last match
  std::uint64_t duplicates = 0;     ///< unmatched estimates close to a counted true object
  std::uint64_t interruptions = 0;  ///< counted frames without a match, between matched ones
  std::uint64_t ids_matched = 0;    ///< distinct ids, summed over true objects
  std::uint64_t ids_near = 0;       ///< the same, with the ids of duplicates
  double minutes = 0.0;             ///< duration of counted ground truth, summed over objects
  double position_error_m = 0.0;    ///< mean over the matches
  double mean_object_recall = 0.0;
  std::uint64_t objects = 0, objects_found = 0;  ///< all true objects; those matched at least once
  std::uint64_t neutral = 0, outside = 0;        ///< estimates that do not count
  std::vector<Mishap> mishaps;

  /// Map objects for each true object that was found; 1 is perfect.
  double idsPerFound() const;
};

struct ScoreOptions {
  bool strict = false;  ///< counts estimates on ignored labels as false alarms
  double frame_interval_s = 0.1;
};

struct Estimate {
  std::uint64_t id = 0;
  std::string class_name;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double heading = 0;
  Box box;  ///< box of the cuboid's corners, clipped to the image
};

struct ScoredFrame {
  TruthFrame truth;
  std::vector<Estimate> estimates;
};

/// Whether an unmatched estimate belongs to an ignored label and not to a counted one.
bool isNeutral(const Estimate& estimate, const TruthFrame& truth);

/// Scores `frames`, which are sorted by frame index.
ObjectScore scoreFrames(const std::map<std::uint64_t, ScoredFrame>& frames,
                        const ScoreOptions& options);

/// The row as an estimate in the camera frame; empty if its centre is not in the image.
std::optional<Estimate> toCamera(const EstimateRow& row, const RigidTransform& T_RW,
                                 const replay::KittiCalibration& calibration);

ObjectScore scoreObjects(const std::vector<EstimateRow>& rows,
                         const std::map<std::uint64_t, TruthFrame>& truth,
                         const PosesByFrame& poses, const replay::KittiCalibration& calibration,
                         const ScoreOptions& options);

}  // namespace perdure::tools

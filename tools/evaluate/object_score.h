// Precision and recall of objects against counted truth, and what goes wrong with identities
// (the paper's Table 1).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tools/evaluate/object_truth.h"

namespace perdure::tools {

inline constexpr std::array<double, 3> kDistances_m{0.5, 1.0, 1.5};
inline constexpr std::array<double, 3> kAngles_deg{30.0, 45.0, 180.0};  ///< the last: any

struct Cell {
  std::uint64_t matched = 0, truth = 0, false_alarms = 0;
  double distance_m = 0.0;       ///< summed over the matched
  double recall() const;         ///< 1 where there is no truth
  double precision() const;      ///< 1 where there are no estimates
  double positionError() const;  ///< metres, mean of the matched
};

/// A false alarm (with the estimate's id) or a miss (with the truth's track), at 1.5 m, any angle.
struct Mishap {
  std::uint64_t frame = 0;
  bool miss = false;
  std::int64_t id = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< in the camera
  double nearest_m =
      0.0;  ///< to the nearest estimate (a miss) or label of any kind (a false alarm)
};

struct ObjectScore {
  std::array<std::array<Cell, 3>, 3> cells{};  ///< [distance][angle]
  // Under 1.5 m, any orientation:
  std::uint64_t id_switches = 0;    ///< a truth's match has another id than its match before
  std::uint64_t duplicates = 0;     ///< unmatched estimates nearest to, and near, a counted truth
  std::uint64_t interruptions = 0;  ///< counted frames without match between frames with one
  std::uint64_t ids_matched = 0;    ///< distinct ids, summed over true objects
  std::uint64_t ids_near = 0;       ///< the same with the duplicates' ids
  double minutes = 0.0;             ///< of counted truth, summed over objects
  double position_error_m = 0.0;    ///< mean of the matched
  double mean_object_recall = 0.0;
  std::uint64_t objects = 0, objects_found = 0;  ///< true objects; those matched at least once
  std::uint64_t neutral = 0, outside = 0;        ///< estimates that were set aside (1.5 m, any)
  std::vector<Mishap> mishaps;

  /// Objects of the map for each true object that was found: 1 is perfect.
  double idsPerFound() const;
};

struct ScoreOptions {
  bool strict = false;  ///< estimates on ignored labels are false alarms too
  double frame_interval_s = 0.1;
};

/// An estimate in the truth's frame of reference.
struct Estimate {
  std::uint64_t id = 0;
  std::string class_name;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double heading = 0;
  Box box;  ///< of the cuboid's corners, cut at the image
};

/// One frame, ready to be scored.
struct ScoredFrame {
  TruthFrame truth;
  std::vector<Estimate> estimates;
};

/// Whether an unmatched estimate belongs to an ignored label rather than to a counted one.
bool isNeutral(const Estimate& estimate, const TruthFrame& truth);

/// Frames by index.
ObjectScore scoreFrames(const std::map<std::uint64_t, ScoredFrame>& frames,
                        const ScoreOptions& options);

}  // namespace perdure::tools

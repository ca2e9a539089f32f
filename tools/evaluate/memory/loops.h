// Whether the loops of a map are correct, what they change, and the distance travelled among known
// objects before the first.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/mapping/frames/anchor_builder.h"
#include "common/mapping/saved_map.h"
#include "common/replay/files/pose_file.h"
#include "tools/evaluate/memory/visits.h"

namespace perdure::tools {

struct LoopOptions {
  /// A loop is wrong above wrong_m and wrong_sigmas · σ in the plane, or above wrong_rad in yaw.
  double wrong_m = 2.0, wrong_sigmas = 4.0;
  double wrong_rad = 0.17453;
  /// The least gap that ends a return visit, and the least number of known objects in it.
  double gap_m = 30.0;
  std::uint64_t objects = 4;
  /// Margin of a return visit, m; a loop whose later anchor lies within closes it.
  double anchor_m = 14.0;
};

/// An edge of kind loop or tracking whose anchors have a true pose.
struct JudgedLoop {
  mapping::EdgeId id = 0;
  mapping::EdgeKind kind = mapping::EdgeKind::kLoop;
  TimePoint from, to;    ///< stamps of its anchors, the earlier one first
  double off_m = 0.0;    ///< error in the plane
  double off_rad = 0.0;  ///< error in yaw, ≥ 0
  double sigma_m = 0.0;  ///< standard deviation that the edge states, along its error
  double weight = 1.0;   ///< weight in the graph
  bool believed = false, wrong = false;
};

struct LoopJudgement {
  std::vector<JudgedLoop> loops;  ///< sorted by id
  std::uint64_t unjudged = 0;     ///< without a true pose, or not in the map

  std::uint64_t believed() const, wrong() const, wrongBelieved() const;
};
/// `truth`: T_WB by time, z up. Anchors are the body's gravity-levelled frames.
LoopJudgement judgeLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                         const LoopOptions& options);

/// ATE of the anchors, RMSE in m; each connected part is aligned by position and yaw.
struct AnchorErrors {
  std::uint64_t anchors = 0;  ///< anchors with a true pose
  double odometry_m = 0.0;    ///< ATE of chained odometry increments, a part for each session
  double map_m = 0.0;         ///< ATE of T_MA, a part for all anchors that accepted edges connect
};
AnchorErrors scoreAnchors(const mapping::SavedMap& map, const replay::PoseFile& truth);

/// A section of the trajectory among objects of an earlier visit.
struct ReturnVisit {
  std::size_t first = 0, last = 0;  ///< frame indices
  std::uint64_t objects = 0;        ///< visible objects of earlier visits
  /// Distance travelled in the visit to the anchor of its first accepted correct loop in the map.
  std::optional<double> closed_after_m;
};
/// `frames`: of besideTheBody. The map does not store loops that later ones replaced.
std::vector<ReturnVisit> returnVisits(const std::vector<MemoryFrame>& frames,
                                      const std::vector<JudgedLoop>& loops,
                                      const MemoryOptions& memory, const LoopOptions& options);

struct LoopScore {
  LoopJudgement judgement;
  AnchorErrors anchors;
  std::vector<ReturnVisit> returns;

  std::uint64_t missed() const;  ///< return visits without a loop
  /// Median distance of the return visits with a loop.
  std::optional<double> wayToClose() const;
};
LoopScore scoreLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                     const std::vector<MemoryFrame>& frames, const MemoryOptions& memory,
                     const LoopOptions& options);

}  // namespace perdure::tools

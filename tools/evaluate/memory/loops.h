// Checks whether the loops of a map are correct, their effect on the trajectory, and the distance
// travelled among known objects before the first loop.
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
  /// A loop is wrong if its horizontal error exceeds both wrong_m and wrong_sigmas · σ, or if its
  /// yaw error exceeds wrong_rad.
  double wrong_m = 2.0, wrong_sigmas = 4.0;
  double wrong_rad = 0.17453;
  /// A return visit ends after `gap_m` metres of travel without an object of an earlier visit. It
  /// counts if it has at least `objects` such objects.
  double gap_m = 30.0;
  std::uint64_t objects = 4;
  /// Margin before and after a return visit, m of travel. A loop closes the visit if its later
  /// anchor lies within the margin.
  double anchor_m = 14.0;
};

/// An edge of kind loop or tracking whose anchors have a true pose.
struct JudgedLoop {
  mapping::EdgeId id = 0;
  mapping::EdgeKind kind = mapping::EdgeKind::kLoop;
  TimePoint from, to;    ///< stamps of its anchors, the earlier one first
  double off_m = 0.0;    ///< horizontal error
  double off_rad = 0.0;  ///< error in yaw, ≥ 0
  double sigma_m = 0.0;  ///< standard deviation of the edge along its error
  double weight = 1.0;   ///< weight in the graph
  bool believed = false, wrong = false;
};

struct LoopJudgement {
  std::vector<JudgedLoop> loops;  ///< sorted by id
  std::uint64_t unjudged = 0;     ///< edges whose anchors are not in the map or have no true pose

  std::uint64_t believed() const, wrong() const, wrongBelieved() const;
};
/// Compares the map's edges with `truth` (T_WB by time, z up). Anchors are gravity-levelled body
/// frames.
LoopJudgement judgeLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                         const LoopOptions& options);

/// ATE of the anchor positions, RMSE in m. Each connected part is aligned with ground truth by
/// position and yaw. Parts with one anchor are omitted.
struct AnchorErrors {
  std::uint64_t anchors = 0;  ///< anchors with a true pose
  double odometry_m = 0.0;    ///< ATE of chained odometry increments; each session is one part
  double map_m = 0.0;         ///< ATE of T_MA; anchors that accepted edges connect are one part
};
AnchorErrors scoreAnchors(const mapping::SavedMap& map, const replay::PoseFile& truth);

/// A section of the trajectory among objects of an earlier visit.
struct ReturnVisit {
  std::size_t first = 0, last = 0;  ///< frame indices
  std::uint64_t objects = 0;        ///< visible objects of earlier visits
  /// Distance travelled in the visit to the anchor of its first accepted correct loop in the map.
  std::optional<double> closed_after_m;
};
/// Finds the return visits in `frames`, the result of besideTheBody. If a later loop replaced an
/// earlier one, closed_after_m belongs to the later one, because the map stores only that.
std::vector<ReturnVisit> returnVisits(const std::vector<MemoryFrame>& frames,
                                      const std::vector<JudgedLoop>& loops,
                                      const MemoryOptions& memory, const LoopOptions& options);

struct LoopScore {
  LoopJudgement judgement;
  AnchorErrors anchors;
  std::vector<ReturnVisit> returns;

  std::uint64_t missed() const;  ///< return visits without a loop
  /// Median of closed_after_m over the return visits with a loop; empty if there is none.
  std::optional<double> wayToClose() const;
};
LoopScore scoreLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                     const std::vector<MemoryFrame>& frames, const MemoryOptions& memory,
                     const LoopOptions& options);

}  // namespace perdure::tools

// Whether the loops of a map are true: each against the exact relation of its two anchors, what
// they did to the way, and how far the body drove among known objects before one was closed.
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
  /// A loop is wrong where it is off by more than the larger of these in the plane, or in yaw.
  double wrong_m = 2.0, wrong_sigmas = 4.0;
  double wrong_rad = 0.17453;
  /// Of a return: ways without an object of an earlier visit that are shorter do not end it, and at
  /// least so many objects of earlier visits are seen.
  double gap_m = 30.0;
  std::uint64_t objects = 4;
  /// An anchor lies up to this far behind the body that closes the loop.
  double anchor_m = 14.0;
};

/// An edge of kind loop or tracking whose anchors have a true pose.
struct JudgedLoop {
  mapping::EdgeId id = 0;
  mapping::EdgeKind kind = mapping::EdgeKind::kLoop;
  TimePoint from, to;    ///< stamps of its anchors, the earlier one first
  double off_m = 0.0;    ///< in the plane
  double off_rad = 0.0;  ///< in yaw, ≥ 0
  double sigma_m = 0.0;  ///< that the edge states, along its error
  double weight = 1.0;   ///< by which it counts in the graph
  bool believed = false, wrong = false;
};

struct LoopJudgement {
  std::vector<JudgedLoop> loops;  ///< by id
  std::uint64_t unjudged = 0;     ///< edges of these kinds whose anchors have no true pose or are
                                  ///< not in the map

  std::uint64_t believed() const, wrong() const, wrongBelieved() const;
};
/// `truth`: T_WB by time, z up. Anchors are the body's level frames.
LoopJudgement judgeLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                         const LoopOptions& options);

/// ATE of the anchors' places, RMSE, m: each part that hangs together is aligned with the truth by
/// position and yaw. Parts with one anchor are left out.
struct AnchorErrors {
  std::uint64_t anchors = 0;  ///< that have a true pose
  double odometry_m = 0.0;    ///< by chained increments of the odometry, a part for each session
  double map_m = 0.0;         ///< by T_MA, a part for all that believed edges join
};
AnchorErrors scoreAnchors(const mapping::SavedMap& map, const replay::PoseFile& truth);

/// A stretch of way among objects that an earlier visit saw.
struct ReturnVisit {
  std::size_t first = 0, last = 0;  ///< frames
  std::uint64_t objects = 0;        ///< of earlier visits that are seen
  /// Driven in it up to the anchor of its first loop that is kept, believed and not wrong.
  std::optional<double> closed_after_m;
};
/// `frames` as besideTheBody gives them. Where a later loop took a loop's place, it counts from the
/// later one: the map holds no other.
std::vector<ReturnVisit> returnVisits(const std::vector<MemoryFrame>& frames,
                                      const std::vector<JudgedLoop>& loops,
                                      const MemoryOptions& memory, const LoopOptions& options);

struct LoopScore {
  LoopJudgement judgement;
  AnchorErrors anchors;
  std::vector<ReturnVisit> returns;

  std::uint64_t missed() const;  ///< returns without a loop
  /// Median of those that have one.
  std::optional<double> wayToClose() const;
};
LoopScore scoreLoops(const mapping::SavedMap& map, const replay::PoseFile& truth,
                     const std::vector<MemoryFrame>& frames, const MemoryOptions& memory,
                     const LoopOptions& options);

}  // namespace perdure::tools

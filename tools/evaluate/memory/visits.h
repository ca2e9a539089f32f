// Checks whether an object that is seen again keeps its id. Reports are matched to truth relative
// to the body, so that drift has no effect.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::tools {

struct MemoryOptions {
  double reach_m = 25.0;    ///< largest distance of an object from the body
  double near_m = 1.5;      ///< largest distance of a report from its object
  double least_seen = 0.5;  ///< least visible share of an object that counts as visible
  double apart_s = 60.0;    ///< least time between two visits
};

/// A visible true object, and the id of the report that matches it.
struct Sighting {
  std::uint64_t object = 0;
  std::optional<std::uint64_t> id;
};
struct MemoryFrame {
  TimePoint time;
  double way_m = 0.0;  ///< true distance travelled since the first frame
  RigidTransform T_WB, true_T_WB;
  std::vector<Sighting> sightings;
  std::set<std::uint64_t> reported;  ///< ids of all reports, matched or not
};

/// Returns the frames of the run with a pose, in order. Objects count if they never move, are not
/// toys, are within reach and sufficiently visible. A report matches an object of its class; pairs
/// are matched one-to-one, greedily by distance in the body frame.
std::vector<MemoryFrame> besideTheBody(const SimulatedTruth& truth,
                                       const std::vector<EstimateRow>& rows,
                                       const std::vector<replay::StampedPose>& trajectory,
                                       const MemoryOptions& options);

/// A series of frames in which an object is visible, with gaps shorter than `apart_s`.
struct Visit {
  std::vector<std::size_t> frames;           ///< indices of frames of the run
  std::map<std::uint64_t, std::size_t> ids;  ///< number of frames in which each id matched

  /// The id that matched in most frames; the smallest one on a tie. Empty if no report matched.
  std::optional<std::uint64_t> id() const;
};
std::map<std::uint64_t, std::vector<Visit>> visitsOf(const std::vector<MemoryFrame>& frames,
                                                     const MemoryOptions& options);

struct MemoryScore {
  std::uint64_t frames = 0, sightings = 0, matched = 0;
  std::uint64_t late_sightings = 0, late_matched = 0;  ///< counts of the second half of the frames
  std::uint64_t objects = 0, seen_twice = 0;
  /// reported_twice: objects reported on two visits; kept: those with the same id on the first and
  /// the last of these.
  std::uint64_t reported_twice = 0, kept = 0;
  std::uint64_t objects_matched = 0, ids = 0, with_more_ids = 0;  ///< ids: summed over objects
  /// Median displacement in W (m) of objects seen on two visits, from the first visit to the last.
  double drift_m = 0.0;

  double keptShare() const;  ///< 1 if nothing was reported twice
  double recall() const;     ///< 1 if nothing was visible
  double lateRecall() const;
  double idsPerObject() const;  ///< 1 is perfect
};
MemoryScore scoreMemory(const SimulatedTruth& truth, const std::vector<MemoryFrame>& frames,
                        const MemoryOptions& options);

struct ReturnScore {
  std::uint64_t ids = 0;    ///< ids that the earlier run reported
  std::uint64_t known = 0;  ///< objects that the earlier run reported and this run sees
  /// Sightings of known objects from the first report of a known id on: visible, and reported.
  std::uint64_t seen = 0, reported = 0;
  std::uint64_t kept = 0;   ///< objects with the id of the last earlier visit
  std::uint64_t wrong = 0;  ///< objects with an id of another object
  struct First {
    double seconds = 0.0, way_m = 0.0;
    std::uint64_t objects = 0;  ///< objects visible up to that frame, inclusive
  };
  std::optional<First> first;

  double keptShare() const;  ///< share of the known objects; 1 if there are none
};
ReturnScore scoreReturn(const std::vector<MemoryFrame>& before, const std::vector<MemoryFrame>& now,
                        const MemoryOptions& options);

}  // namespace perdure::tools

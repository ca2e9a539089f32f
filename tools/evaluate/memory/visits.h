// Whether an object that is seen again after a while still has its id: a run's reports matched to
// the truth beside the body, so that what the frame has drifted does not count, and the visits to
// each true object.
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
  double reach_m = 25.0;    ///< how far from the body an object may be
  double near_m = 1.5;      ///< of a report from the object that it matches
  double least_seen = 0.5;  ///< share of an object that is in sight where it is visible
  double apart_s = 60.0;    ///< between two visits
};

/// A true object that is visible, and the id of the report that matches it.
struct Sighting {
  std::uint64_t object = 0;
  std::optional<std::uint64_t> id;
};
struct MemoryFrame {
  TimePoint time;
  double way_m = 0.0;  ///< true, since the run's first frame
  RigidTransform T_WB, true_T_WB;
  std::vector<Sighting> sightings;
  std::set<std::uint64_t> reported;  ///< ids, matched or not
};

/// Frames of the run that have a pose, in order. Objects that never move, but for toys, within
/// reach, visible enough. A report matches an object of its class; pairs greedily by distance in
/// the body's frame, one to one.
std::vector<MemoryFrame> besideTheBody(const SimulatedTruth& truth,
                                       const std::vector<EstimateRow>& rows,
                                       const std::vector<replay::StampedPose>& trajectory,
                                       const MemoryOptions& options);

/// Frames in which an object is visible, with gaps shorter than `apart_s`.
struct Visit {
  std::vector<std::size_t> frames;           ///< indices into the run's
  std::map<std::uint64_t, std::size_t> ids;  ///< in how many of them each was matched to it

  /// In most frames; of equal ones the least. Nothing where no report matched.
  std::optional<std::uint64_t> id() const;
};
/// By true object.
std::map<std::uint64_t, std::vector<Visit>> visitsOf(const std::vector<MemoryFrame>& frames,
                                                     const MemoryOptions& options);

struct MemoryScore {
  std::uint64_t frames = 0, sightings = 0, matched = 0;
  std::uint64_t late_sightings = 0, late_matched = 0;  ///< in the second half of the frames
  std::uint64_t objects = 0, seen_twice = 0;
  /// Reported on two visits, the first and the last ones are taken; of these with the same id.
  std::uint64_t reported_twice = 0, kept = 0;
  std::uint64_t objects_matched = 0, ids = 0, with_more_ids = 0;  ///< ids: summed over objects
  /// By how much the true place of what is seen twice moved in W from its first visit to its last:
  /// the median.
  double drift_m = 0.0;

  double keptShare() const;  ///< 1 where nothing was reported twice
  double recall() const;     ///< 1 where nothing was visible
  double lateRecall() const;
  double idsPerObject() const;  ///< 1 is perfect
};
MemoryScore scoreMemory(const SimulatedTruth& truth, const std::vector<MemoryFrame>& frames,
                        const MemoryOptions& options);

/// A run that began with the map of another one.
struct ReturnScore {
  std::uint64_t ids = 0;    ///< that the run before had reported
  std::uint64_t known = 0;  ///< objects it had reported, and that this run sees
  /// Of these: seen, and reported, once the first known id was there.
  std::uint64_t seen = 0, reported = 0;
  std::uint64_t kept = 0;   ///< with the id that they had on the last visit before
  std::uint64_t wrong = 0;  ///< with an id that was another object's
  /// When the first known id was there.
  struct First {
    double seconds = 0.0, way_m = 0.0;
    std::uint64_t objects = 0;  ///< that had been in view, that frame included
  };
  std::optional<First> first;

  double keptShare() const;  ///< of the known ones; 1 where there are none
};
ReturnScore scoreReturn(const std::vector<MemoryFrame>& before, const std::vector<MemoryFrame>& now,
                        const MemoryOptions& options);

}  // namespace perdure::tools

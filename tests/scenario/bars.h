// Requirements of each scene, as bars over one run. They use only what a user sees: the published
// objects of each frame, the events, and the final map.
#pragma once

#include <map>
#include <vector>

#include "tests/scenario/scenario.h"

namespace perdure::test {

/// Bars of a camera that sees a toy car, which appears as large as a real car far away.
/// `no_size_prior` is a run of the same scene without the filter's prior of car sizes.
Bars toyBars(const Outcome& run, const Outcome& no_size_prior);
/// Returns the setting for such a filter; writes the priors that it needs.
Setting withoutSizePrior(Setting setting);
Bars stillBars(const Outcome& run);
Bars occlusionBars(const Outcome& run);
Bars vanishBars(const Outcome& run);
Bars roomBars(const Outcome& run);
Bars rowBars(const Outcome& run);
Bars rollBars(const Outcome& run);
Bars trafficBars(const Outcome& run);
Bars streetBars(const Outcome& run);
/// Bars of every scene: confidence on consistent positives, and merges.
Bars everywhereBars(const Outcome& run);
/// FINAL at 1 m, for every scene with enough parallax.
Bars commonBars(const Outcome& run);

/// Runs a scene with each seed and returns all its bars. Sets `setting.scene` and `setting.seed`.
/// Throws std::invalid_argument for a scene without bars.
std::vector<Bars> barsOf(const std::string& scene, const std::vector<std::uint64_t>& seeds,
                         const Setting& setting = {});
/// Returns the scenes that have bars.
const std::vector<std::string>& scenesWithBars();

double number(std::size_t count);
/// Returns the id of the class with the most rows within `within` metres of a place, in frames from
/// `from` until before `until`; 0 if there is none.
std::uint64_t mostClaimed(const std::vector<tools::EstimateRow>& rows, const Eigen::Vector3d& place,
                          double within, const std::string& class_name, std::uint64_t from = 0,
                          std::uint64_t until = ~0ULL);
/// A permanently standing object, and the ids that the filter gave it in each half of the run.
struct IdsByHalf {
  const sim::TruthObject* object = nullptr;
  std::uint64_t first = 0, second = 0;
};
/// Returns the objects that have an id in both halves.
std::vector<IdsByHalf> idsByHalf(const Outcome& run);
/// Returns the objects of the final map that are estimated as standing but have no true object
/// within 3 m.
std::vector<MapObject> ghosts(const Outcome& run);
/// Returns the true objects that were nearest to the object in frames with a hit, and the number of
/// these frames.
std::map<const sim::TruthObject*, std::size_t> foundNearest(const Outcome& run, ObjectId id);
/// Returns the index of the frame nearest to `time`.
std::uint64_t frameAt(const Outcome& run, TimePoint time);

}  // namespace perdure::test

// What each scene must show, as bars over one run. What is asked is what a user sees: what was
// published of each object in each frame, events, the map at the end.
#pragma once

#include <map>
#include <vector>

#include "tests/scenario/scenario.h"

namespace perdure::test {

/// Of a camera that sees a toy, in the image as large as a real car far away. `no_size_prior` is
/// the same scene with a filter that is not told how large cars are.
Bars toyBars(const Outcome& run, const Outcome& no_size_prior);
/// A setting with that filter; it writes the priors that it needs.
Setting withoutSizePrior(Setting setting);
Bars stillBars(const Outcome& run);
Bars occlusionBars(const Outcome& run);
Bars vanishBars(const Outcome& run);
Bars roomBars(const Outcome& run);
Bars rowBars(const Outcome& run);
Bars rollBars(const Outcome& run);
Bars trafficBars(const Outcome& run);
Bars streetBars(const Outcome& run);
/// Asked in every scene: confidence on consistent positives, and merges.
Bars everywhereBars(const Outcome& run);
/// FINAL at 1 m, of every scene with enough parallax.
Bars commonBars(const Outcome& run);

/// All bars of a scene, by its name: runs it with each seed. `setting.scene` and `.seed` are set
/// here. Throws std::invalid_argument for a scene that has none.
std::vector<Bars> barsOf(const std::string& scene, const std::vector<std::uint64_t>& seeds,
                         const Setting& setting = {});
/// Scenes that have bars.
const std::vector<std::string>& scenesWithBars();

double number(std::size_t count);
/// The id that is claimed most often within so many metres of a place, in frames from `from` until
/// before `until`; 0: none.
std::uint64_t mostClaimed(const std::vector<tools::EstimateRow>& rows, const Eigen::Vector3d& place,
                          double within, const std::string& class_name, std::uint64_t from = 0,
                          std::uint64_t until = ~0ULL);
/// A thing that stands all the time, and the ids by which it was claimed in the halves of the run.
struct IdsByHalf {
  const sim::TruthObject* object = nullptr;
  std::uint64_t first = 0, second = 0;
};
/// Of those that were claimed in both.
std::vector<IdsByHalf> idsByHalf(const Outcome& run);
/// What is on the map at the end, is believed to stand, and has nothing within 3 m.
std::vector<MapObject> ghosts(const Outcome& run);
/// True things, and in how many frames that found the object each was the nearest to it.
std::map<const sim::TruthObject*, std::size_t> foundNearest(const Outcome& run, ObjectId id);
/// The index of the frame nearest to that time.
std::uint64_t frameAt(const Outcome& run, TimePoint time);

}  // namespace perdure::test

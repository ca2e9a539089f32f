// Fuses the maps of two vehicles in one simulated town. Each vehicle has its own drift, frame and
// detections. The result has one object for each true object.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "services/map_store/core/belief_codec.h"
#include "services/map_store/core/map_contents.h"
#include "services/map_store/core/schema.h"
#include "tests/services/map_store/beliefs.h"
#include "tools/evaluate/memory/visits.h"
#include "tools/map/fuse.h"
#include "tools/pipeline/pipeline.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using map_store::test::TemporaryFolder;

struct Leg {
  std::int64_t seed = 1;
  double from_s = 0.0, seconds = 0.0;
};

fs::path town(const fs::path& folder, double seconds) {
  SimulateOptions options;
  options.scene = "town";
  options.seed = 3;
  options.out = folder / "town";
  options.world.seconds = seconds;
  options.world.rate_hz = 5.0;
  options.images = false;
  (void)simulate(options, {});
  return options.out;
}

fs::path drive(const fs::path& data, const Leg& leg) {
  PipelineOptions options;
  options.data = data.string();
  options.odometry = "drifting";
  options.detections = "simulated";
  options.out = (data.parent_path() / ("run" + std::to_string(leg.seed))).string();
  options.from = leg.from_s;
  options.seconds = leg.seconds;
  options.seed = leg.seed;
  options.quiet = true;
  options.assignments = {"drifting.own_frame=true", "map_store.graph.enabled=true"};
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  pipeline.finish();
  return options.out;
}

/// Returns the true object with which each id of a run was matched most often.
std::map<ObjectId, std::uint64_t> trueObjects(const fs::path& run, const SimulatedTruth& truth) {
  const auto frames = besideTheBody(truth, readObjectRows(run / "objects_inst.csv"),
                                    replay::PoseFile::read(run / "trajectory.tum").poses(), {});
  std::map<ObjectId, std::map<std::uint64_t, std::size_t>> votes;
  for (const MemoryFrame& frame : frames) {
    for (const Sighting& sighting : frame.sightings) {
      if (sighting.id) ++votes[*sighting.id][sighting.object];
    }
  }
  std::map<ObjectId, std::uint64_t> objects;
  for (const auto& [id, of] : votes) {
    objects[id] = std::max_element(of.begin(), of.end(), [](const auto& a, const auto& b) {
                    return a.second < b.second;
                  })->first;
  }
  return objects;
}

mapping::MapContents contentsOf(const fs::path& file) {
  auto map = map_store::readWholeMap(map_store::openStoreForReading(file.string()));
  EXPECT_TRUE(map);
  return std::move(map->contents);
}

struct Duplicates {
  std::map<std::uint64_t, std::set<ObjectId>> ids_of;
  std::map<ObjectId, std::set<std::uint64_t>> objects_of;

  double each() const {
    double ids = 0.0;
    for (const auto& [object, of] : ids_of) ids += static_cast<double>(of.size());
    return ids / static_cast<double>(ids_of.size());
  }
  std::size_t mixed() const {
    return static_cast<std::size_t>(std::count_if(
        objects_of.begin(), objects_of.end(), [](const auto& e) { return e.second.size() > 1; }));
  }
};

void count(Duplicates& duplicates, const mapping::MapContents& fused, const fs::path& run,
           const SimulatedTruth& truth) {
  const mapping::MapContents own = contentsOf(run / "map.sqlite");
  const auto root = mapping::sessionsOf(own.graph).front().identity;
  const bool begins = mapping::sessionsOf(fused.graph).front().identity.matches(root);
  for (const auto& [id, object] : trueObjects(run, truth)) {
    const auto mine = own.objects.find(id);
    if (mine == own.objects.end() || mine->second.ended) continue;
    ObjectId now = begins ? id : 0;
    for (const auto& origin : fused.origins) {
      if (origin.id == id && origin.map.matches(root)) now = origin.now;
    }
    now = mapping::survivorOf(fused, now);
    if (!fused.objects.contains(now) || fused.objects.at(now).ended) continue;
    duplicates.ids_of[object].insert(now);
    duplicates.objects_of[now].insert(object);
  }
}

TEST(FuseTown, TwoVehiclesHaveOneObjectForEachTrueOne) {
  const TemporaryFolder folder;
  const fs::path data = town(folder.path(), 360.0);
  const fs::path a = drive(data, {1, 0.0, 220.0}), b = drive(data, {2, 140.0, 220.0});
  const std::string map_a = (a / "map.sqlite").string(), map_b = (b / "map.sqlite").string();
  const FuseOutcome outcome = fuseFiles({{map_a, map_b}, folder.file("ab")});
  EXPECT_EQ(outcome.parts.size(), 1u);
  EXPECT_GT(outcome.merges(), 20u);
  const mapping::MapContents fused = contentsOf(folder.file("ab"));
  const SimulatedTruth truth = readSimulatedTruth(data);
  Duplicates duplicates;
  for (const fs::path& run : {a, b}) count(duplicates, fused, run, truth);
  EXPECT_GT(duplicates.ids_of.size(), 100u);
  EXPECT_LE(duplicates.each(), 1.03);
  EXPECT_EQ(duplicates.mixed(), 0u);

  (void)fuseFiles({{map_b, folder.file("ab"), map_a}, folder.file("aba")});
  const mapping::MapContents again = contentsOf(folder.file("aba"));
  ASSERT_EQ(again.objects.size(), fused.objects.size());
  for (const auto& [id, object] : fused.objects) {
    EXPECT_EQ(map_store::encodeBelief(again.objects.at(id).belief),
              map_store::encodeBelief(object.belief));
  }
}

}  // namespace
}  // namespace perdure::tools

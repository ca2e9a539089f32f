// Ids survive when the odometry begins a new frame of reference. The map store is the real one; it
// receives the odometry and locates the session on the earlier map.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/services/semantic_filter/memory_run.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

/// Cars at irregular gaps and a few people on both sides of a street of 120 m.
std::vector<TrueObject> longStreet(double least_gap = 7.0, unsigned seed = 3) {
  std::vector<TrueObject> things;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (const double side : {-4.5, 4.5}) {
    for (double x = 14.0; x < 120.0; x += least_gap + 6.0 * any(random)) {
      const bool person = any(random) < 0.25;
      things.push_back(person
                           ? TrueObject{makeState(x, 1.3 * side, 0.85, 0, 0.6, 0.6, 1.7), "person"}
                           : TrueObject{makeState(x, side, 0.75, 0.1 * any(random),
                                                  4.1 + 0.4 * any(random), 1.75, 1.5),
                                        "car"});
    }
  }
  return things;
}

/// The odometry restarts with another frame of reference.
void beginAnew(Pair& pair) {
  ++pair.world.epoch;
  pair.T_W = RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(2.2, Eigen::Vector3d::UnitZ())),
                            {140.0, -35.0, 2.0});
}

/// The id of the confirmed track of each object, by its number; 0 if there is none.
std::vector<ObjectId> idsOf(const Pair& pair) {
  std::vector<ObjectId> ids;
  for (const TrueObject& thing : pair.things) {
    const Eigen::Vector3d place = pair.T_W * Eigen::Vector3d(thing.x.head<3>());
    ObjectId id = 0;
    for (const auto& o : pair.objects.back().objects) {
      if (o.confirmed && (o.best().mean.head<3>() - place).norm() < 1.5) id = o.id;
    }
    ids.push_back(id);
  }
  return ids;
}

struct Kept {
  std::size_t known = 0, kept = 0, changed = 0;
};
Kept compare(const std::vector<ObjectId>& before, const std::vector<ObjectId>& after) {
  Kept result;
  for (std::size_t i = 0; i < before.size(); ++i) {
    result.known += before[i] != 0;
    if (before[i] == 0 || after[i] == 0) continue;
    before[i] == after[i] ? ++result.kept : ++result.changed;
  }
  return result;
}

std::unique_ptr<Pair> onStreet(const MemoryParameters& memory = kMemory, unsigned seed = 3) {
  return std::make_unique<Pair>(configWith(memory), longStreet(7.0, seed));
}

/// Metres driven until every object with a confirmed track has its old id again, at least `least`.
double metresUntilBack(Pair& pair, const std::vector<ObjectId>& before, double until,
                       std::size_t least) {
  const double from = pair.x, way = until > from ? 0.4 : -0.4;
  while (std::abs(until - pair.x) > 0.5) {
    pair.driveTo(pair.x + way);
    const Kept now = compare(before, idsOf(pair));
    if (now.kept >= least && now.changed == 0) return std::abs(pair.x - from);
  }
  return 1e9;
}

TEST(OdometryReset, KnownObjectsKeepTheirIds) {
  const auto pair = onStreet();
  pair->driveTo(60);
  const auto before = idsOf(*pair);
  ASSERT_GE(compare(before, before).known, 8u);
  beginAnew(*pair);
  pair->driveTo(20);
  pair->driveTo(60);
  const Kept ids = compare(before, idsOf(*pair));
  EXPECT_GE(ids.kept, ids.known - 1) << "of " << ids.known;
  EXPECT_EQ(ids.changed, 0u);
  EXPECT_GT(pair->count(EventKind::kRecalled), 0u);
  EXPECT_GT(pair->count(EventKind::kMerged), 0u) << "objects that had new ids meanwhile";
}

/// When the filter itself searched for its working set of before, it needed 9.6, 29.6, 14.4, 21.2,
/// 17.6 and 19.6 m on these streets.
TEST(OdometryReset, IdsAreBackAfterAFewMetres) {
  const std::vector<unsigned> seeds{3, 4, 5, 6, 7, 8};
  double sum_m = 0.0;
  for (const unsigned seed : seeds) {
    const auto pair = onStreet(kMemory, seed);
    pair->driveTo(60);
    const auto before = idsOf(*pair);
    beginAnew(*pair);
    const double distance_m = metresUntilBack(*pair, before, 110.0, 4);
    EXPECT_LT(distance_m, 20.0) << seed;
    sum_m += distance_m;
  }
  EXPECT_LT(sum_m / static_cast<double>(seeds.size()), 14.0);
}

TEST(OdometryReset, ArchivedObjectsComeBackIntoTheNewFrameOfReference) {
  const auto pair = onStreet({true, 40.0, 10.0, 2.0});
  pair->driveTo(30);
  const auto early = idsOf(*pair);
  pair->driveTo(110);
  ASSERT_GE(pair->count(EventKind::kArchived), 4u);
  beginAnew(*pair);
  pair->driveTo(60);
  pair->driveTo(0);
  pair->driveTo(30);
  const Kept ids = compare(early, idsOf(*pair));
  ASSERT_GE(ids.known, 5u);
  EXPECT_GE(ids.kept, ids.known - 1) << "of " << ids.known;
  EXPECT_EQ(ids.changed, 0u);
}

/// A body at rest gets its ids back from the objects alone.
TEST(OdometryReset, ABodyThatHardlyMovesIsFound) {
  const auto pair = onStreet();
  pair->driveTo(60);
  const auto before = idsOf(*pair);
  beginAnew(*pair);
  for (int k = 0; k < 30; ++k) {
    pair->driveTo(60.4, 0.1);
    pair->driveTo(60.0, 0.1);
  }
  const Kept ids = compare(before, idsOf(*pair));
  EXPECT_GE(ids.kept, 3u) << "of " << ids.known;
  EXPECT_EQ(ids.changed, 0u);
}

TEST(OdometryReset, AnotherPlaceIsNotTakenForTheEarlierMap) {
  const auto pair = onStreet();
  pair->driveTo(60);
  const auto before = pair->confirmed();
  beginAnew(*pair);
  // other gaps, and some objects of another class
  for (std::size_t i = 0; i < pair->things.size(); ++i) {
    pair->things[i].x[0] += 5.0 * std::sin(2.7 * static_cast<double>(i));
    pair->things[i].x[1] *= 1.0 + 0.4 * std::cos(1.9 * static_cast<double>(i));
  }
  pair->driveTo(20);
  pair->driveTo(60);
  for (const ObjectId id : pair->confirmed()) EXPECT_FALSE(before.contains(id)) << id;
}

}  // namespace
}  // namespace perdure::semantic_filter

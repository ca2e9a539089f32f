// A map that survives the odometry's frame of reference, with the real map store behind the node.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/services/semantic_filter/memory_run.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

/// Cars at uneven gaps and a few people on both sides of a street of 120 m.
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

/// The odometry restarts: from here on it has another frame of reference.
void beginAnew(Pair& pair) {
  ++pair.world.epoch;
  pair.T_W = RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(2.2, Eigen::Vector3d::UnitZ())),
                            {140.0, -35.0, 2.0});
}

bool looksForFormerMap(const std::string& note) {
  return note.find("things of the map of before") != std::string::npos;
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

TEST(FormerMap, KnownObjectsKeepTheirIdsWhenOdometryRestarts) {
  Pair pair(configWith(kMemory), longStreet());
  pair.driveTo(60);
  const auto before = idsOf(pair);
  const std::size_t known = before.size() - static_cast<std::size_t>(std::count(
                                                before.begin(), before.end(), ObjectId{0}));
  ASSERT_GE(known, 8u);
  beginAnew(pair);
  pair.driveTo(20);
  pair.driveTo(60);
  const auto after = idsOf(pair);
  std::size_t kept = 0, changed = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] == 0 || after[i] == 0) continue;
    before[i] == after[i] ? ++kept : ++changed;
  }
  EXPECT_GE(kept, known - 1) << "of " << known;
  EXPECT_EQ(changed, 0u);
  const auto told = std::find_if(pair.events.begin(), pair.events.end(),
                                 [](const Event& e) { return e.kind == EventKind::kRecalled; });
  ASSERT_NE(told, pair.events.end());
  EXPECT_EQ(told->detail, "of frame of reference 5/0, found again");
  EXPECT_GT(pair.count(EventKind::kMerged), 0u) << "what was taken for new meanwhile";
  EXPECT_FALSE(looksForFormerMap(pair.filter.note()));
}

TEST(FormerMap, ArchivedObjectsComeBackIntoTheNewFrameOfReference) {
  Pair pair(configWith({true, 40.0, 10.0, 2.0}), longStreet());
  pair.driveTo(30);
  const auto early = idsOf(pair);
  pair.driveTo(110);
  ASSERT_GE(pair.count(EventKind::kArchived), 4u);
  beginAnew(pair);
  pair.driveTo(60);
  ASSERT_FALSE(looksForFormerMap(pair.filter.note())) << pair.filter.note();
  pair.driveTo(0);
  pair.driveTo(30);
  const auto late = idsOf(pair);
  std::size_t kept = 0, known = 0;
  for (std::size_t i = 0; i < early.size(); ++i) {
    if (early[i] == 0) continue;
    ++known;
    kept += early[i] == late[i];
    EXPECT_TRUE(late[i] == 0 || early[i] == late[i]) << i;
  }
  ASSERT_GE(known, 5u);
  EXPECT_GE(kept, known - 1) << "of " << known;
}

TEST(FormerMap, ALaterRunFindsTheMapOfAnEarlierRun) {
  Pair yesterday(configWith(kMemory), longStreet());
  yesterday.driveTo(60);
  const auto before = idsOf(yesterday);
  Recalled restored;  // as the map store answers a filter that starts
  restored.restore = true;
  restored.client = 9;
  restored.world = yesterday.world;
  restored.next_id = yesterday.objects.back().next_id;
  restored.objects = yesterday.objects.back().objects;
  Pair today(configWith(kMemory), longStreet());
  today.filter.onRecalled(restored);
  today.world = {77, 0};
  today.T_W = RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitZ())),
                             {-20.0, 8.0, 0.4});
  today.x = 30.0;
  today.driveTo(60);
  const auto after = idsOf(today);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < before.size(); ++i) kept += before[i] != 0 && before[i] == after[i];
  EXPECT_GE(kept, 9u);
}

/// Mean distance between objects and their confirmed tracks in the present odometry, after driving
/// the street there and back with drift.
double errorAfterDrift(const Config& config, unsigned seed) {
  Pair pair(config, longStreet(4.5, seed));
  pair.driveTo(60);
  pair.drift = RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(4e-5, Eigen::Vector3d::UnitZ())),
                              {0.001, -0.0012, 0.0});
  for (int lap = 0; lap < 5; ++lap) {
    pair.driveTo(8);
    pair.driveTo(60);
  }
  double sum = 0.0, count = 0.0;
  for (const TrueObject& thing : pair.things) {
    const Eigen::Vector3d place = pair.T_W * Eigen::Vector3d(thing.x.head<3>());
    double nearest = 3.0;
    for (const auto& o : pair.objects.back().objects) {
      if (o.confirmed) nearest = std::min(nearest, (o.best().mean.head<3>() - place).norm());
    }
    if (nearest < 3.0) sum += nearest, count += 1.0;
  }
  return sum / count;
}

/// In a single street, chance changes the result by a fifth.
void expectThingsToStayWhileOdometryDrifts(unsigned streets) {
  Config config = configWith(kMemory);
  config.filter.pose.walk_position = 0.03;
  config.filter.pose.walk_rotation = 0.0007;
  config.filter.motion.position_walk = 0.002;  // the objects are at rest
  Config none = config;
  none.filter.drift.things = 1000000;
  double error = 0.0, without = 0.0;
  for (unsigned seed = 3; seed < 3 + streets; ++seed) {
    error += errorAfterDrift(config, seed) / streets;
    without += errorAfterDrift(none, seed) / streets;
  }
  EXPECT_LT(error, 0.85 * without) << error << " m, without " << without << " m";
}

TEST(FormerMap, ObjectsStayInPlaceRelativeToTheBodyWhileOdometryDrifts) {
  expectThingsToStayWhileOdometryDrifts(2);
}

TEST(LongFormerMap, ObjectsStayInPlaceInMoreStreets) {
  expectThingsToStayWhileOdometryDrifts(4);
}

TEST(FormerMap, AnotherPlaceIsNotTakenForTheFormerMap) {
  Pair pair(configWith(kMemory), longStreet());
  pair.driveTo(60);
  const auto before = pair.confirmed();
  beginAnew(pair);
  // other gaps, and some objects of another class
  for (std::size_t i = 0; i < pair.things.size(); ++i) {
    pair.things[i].x[0] += 5.0 * std::sin(2.7 * static_cast<double>(i));
    pair.things[i].x[1] *= 1.0 + 0.4 * std::cos(1.9 * static_cast<double>(i));
  }
  pair.driveTo(20);
  pair.driveTo(60);
  for (const ObjectId id : pair.confirmed()) EXPECT_FALSE(before.contains(id)) << id;
  EXPECT_TRUE(looksForFormerMap(pair.filter.note())) << pair.filter.note();
}

}  // namespace
}  // namespace perdure::semantic_filter

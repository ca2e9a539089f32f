// What leaves the working set for the map and comes back, with the real map store behind the node.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "services/map_store/node.h"
#include "services/semantic_filter/node.h"
#include "services/semantic_filter/object_states.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using map_store::test::TemporaryFolder;
using testing::calibrationOf;
using testing::detect;
using testing::detectionsAt;
using testing::makeCamera;
using testing::makeModelInfo;
using testing::makePriors;
using testing::makeState;
using testing::odometryAt;
using testing::stampOf;
using testing::TrueObject;

const std::vector<TrueObject> kStreet = {{makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
                                         {makeState(22, -4.0, 0.75, 3.0, 4.0, 1.7, 1.45), "car"},
                                         {makeState(30, 4.0, 0.75, 0.0, 4.4, 1.8, 1.5), "car"}};

constexpr MemoryParameters kMemory{true, 100.0, 30.0, 5.0};

Config configWith(const MemoryParameters& memory) {
  Config config;
  config.filter.memory = memory;
  return config;
}

/// The body always looks along x, with the weave that gives parallax.
RigidTransform bodyAt(double x) {
  return RigidTransform(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * std::sin(0.1 * x), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(x, 0.8 * std::sin(0.15 * x), 1.2));
}

std::vector<Detection> boxesFrom(const RigidTransform& T_WB, std::uint64_t k,
                                 const std::vector<TrueObject>& things = kStreet) {
  static const CameraModel camera{makeCamera()};
  std::mt19937 random(static_cast<std::uint32_t>(k));
  View view;
  view.camera = &camera;
  view.T_WB = T_WB;
  std::vector<Detection> list;
  for (const auto& o : things) {
    if (auto d = detect(o, view, BoxParameters{}, 0.5, 3.0, random)) list.push_back(*d);
  }
  return list;
}

/// A filter and a map store, connected as the bus would; who is `deaf` gets and gives nothing.
struct Pair {
  TemporaryFolder folder;
  std::vector<Objects> objects;
  std::vector<Event> events;
  std::vector<std::function<void()>> to_map;
  bool deaf = false;
  std::unique_ptr<map_store::Node> map;
  std::uint64_t frame = 0;
  double x = 0.0;
  std::vector<TrueObject> things;
  WorldId world{5, 0};
  RigidTransform T_W;    ///< the frame of reference of the things, in that of odometry
  RigidTransform drift;  ///< of T_W, with each frame, about the body
  Node filter;

  explicit Pair(const Config& config = configWith(kMemory),
                const std::vector<TrueObject>& street = kStreet)
      : things(street),
        filter(config, makePriors(), 9,
               {.objects =
                    [this](const Objects& m) {
                      objects.push_back(m);
                      if (!deaf) to_map.push_back([this, m] { map->onObjects(m); });
                    },
                .events =
                    [this](const Event& e) {
                      events.push_back(e);
                      if (!deaf) to_map.push_back([this, e] { map->onEvent(e); });
                    },
                .predictions = {},
                .queries =
                    [this](const MapQuery& q) {
                      if (!deaf) to_map.push_back([this, q] { map->onQuery(q); });
                    }}) {
    map_store::Config store;
    store.store_path = folder.file("map.sqlite");
    map = std::make_unique<map_store::Node>(
        store, 5,
        map_store::Outputs{[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
                           [](const MapReply&) {},
                           [this](const Recalled& r) { filter.onRecalled(r); }});
    filter.onCalibration(calibrationOf(makeCamera()));
    filter.onModel(makeModelInfo());
  }

  void talk() {
    for (const auto& message : std::exchange(to_map, {})) message();
    if (!deaf) map->tick(stampOf(frame).time.time_since_epoch());
  }
  /// To `until`, so many metres a frame; what the camera sees is detected.
  void driveTo(double until, double step = 0.4) {
    const double way = until > x ? step : -step;
    for (; std::abs(until - x) > 0.5 * step; x += way, ++frame) {
      const Eigen::Vector3d about = T_W * bodyAt(x).p;
      const RigidTransform turn(drift.q, about - drift.q * about + drift.p);
      T_W = turn * T_W;
      Odometry odometry = odometryAt(frame, T_W * bodyAt(x));
      odometry.world = world;
      filter.onOdometry(odometry);
      filter.onDetections(detectionsAt(frame, boxesFrom(bodyAt(x), frame, things)));
      talk();
    }
  }
  std::size_t count(EventKind kind) const {
    return static_cast<std::size_t>(std::count_if(events.begin(), events.end(),
                                                  [&](const Event& e) { return e.kind == kind; }));
  }
  std::set<ObjectId> confirmed() const {
    std::set<ObjectId> ids;
    for (const auto& o : objects.back().objects) {
      if (o.confirmed) ids.insert(o.id);
    }
    return ids;
  }
};

bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(LongTermMemory, WhatIsFarAndUnseenLeavesForTheMapAndComesBackAsTheSame) {
  Pair pair;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  ASSERT_EQ(street.size(), 3u);
  pair.driveTo(200, 2.0);
  EXPECT_TRUE(pair.objects.back().objects.empty());
  EXPECT_EQ(pair.count(EventKind::kArchived), 3u);
  EXPECT_EQ(pair.count(EventKind::kGone), 0u);
  const std::size_t left = pair.count(EventKind::kLeftView);
  pair.driveTo(60, 2.0);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_EQ(pair.count(EventKind::kRecalled), 3u);
  EXPECT_EQ(pair.count(EventKind::kLeftView), left);
  pair.driveTo(10);
  pair.driveTo(14);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_EQ(pair.count(EventKind::kReappeared), 3u);
  EXPECT_EQ(pair.count(EventKind::kBorn), street.size());
}

TEST(LongTermMemory, ABeliefComesBackBitForBitAndItsLedgerSaysSo) {
  Pair pair;
  pair.driveTo(14);
  pair.driveTo(100, 2.0);
  const Objects before = pair.objects.back();
  ASSERT_EQ(before.objects.size(), 3u);
  pair.driveTo(200, 2.0);
  ASSERT_TRUE(pair.objects.back().objects.empty());
  pair.driveTo(100, 2.0);
  const Objects& after = pair.objects.back();
  ASSERT_EQ(after.objects.size(), 3u);
  for (std::size_t j = 0; j < 3; ++j) {
    const ObjectBelief &a = before.objects[j], &b = after.objects[j];
    EXPECT_EQ(a.id, b.id);
    EXPECT_TRUE(sameBits(a.existence, b.existence));
    EXPECT_EQ(a.confirmed, b.confirmed);
    EXPECT_EQ(a.first_seen, b.first_seen);
    EXPECT_EQ(a.last_seen, b.last_seen);
    EXPECT_EQ(a.as_of, b.as_of);
    EXPECT_EQ(a.hits, b.hits);
    EXPECT_TRUE(b.recalled);
    ASSERT_EQ(a.classes.size(), b.classes.size());
    for (std::size_t c = 0; c < a.classes.size(); ++c) {
      EXPECT_EQ(a.classes[c].name, b.classes[c].name);
      EXPECT_NEAR(a.classes[c].probability, b.classes[c].probability, 1e-15);
      EXPECT_EQ(a.classes[c].mean, b.classes[c].mean);
      EXPECT_EQ(a.classes[c].covariance, b.classes[c].covariance);
      EXPECT_EQ(a.classes[c].cross_pose, b.classes[c].cross_pose);
    }
    const auto recall = static_cast<std::size_t>(ExistenceEvidence::kRecall);
    EXPECT_EQ(a.why.existence[recall].count, 0u);
    EXPECT_EQ(b.why.existence[recall].count, 1u);
    EXPECT_NEAR(b.why.logOdds(), logOdds(b.existence), 1e-9);
  }
  // And the correlation with the pose error refers to what it referred to.
  EXPECT_NE(pair.filter.belief().objects[0].pose_product, Matrix6d::Identity());
}

TEST(LongTermMemory, NothingOnTheMapIsLetGoWhileNoMapAnswersAndHealthCountsIt) {
  Pair pair;
  pair.deaf = true;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(300, 2.0);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_GE(pair.filter.reasons().of("map_store_silent"), 10u);
  pair.deaf = false;  // the map store is started: it gets the working set before anything leaves
  pair.driveTo(360, 2.0);
  EXPECT_TRUE(pair.confirmed().empty());
  pair.driveTo(100, 2.0);
  EXPECT_EQ(pair.confirmed(), street);
}

TEST(LongTermMemory, WhoSubscribesToStatesSeesThemDisposed) {
  Pair pair;
  pair.driveTo(14);
  pair.driveTo(200, 2.0);
  ObjectStates states;
  std::size_t gone = 0;
  for (const Objects& m : pair.objects) gone += states.update(m).gone.size();
  EXPECT_EQ(gone, 3u);
}

TEST(LongTermMemory, LateDetectionsAcrossAnArchivingGiveThePosteriorOfThoseOnTime) {
  Pair on_time, late;
  on_time.driveTo(14), late.driveTo(14);
  std::deque<Detections> waiting;
  const auto frames = [&](double until) {
    on_time.driveTo(until, 2.0);
    const double way = until > late.x ? 2.0 : -2.0;
    for (; std::abs(until - late.x) > 1.0; late.x += way, ++late.frame) {
      late.filter.onOdometry(odometryAt(late.frame, bodyAt(late.x)));
      waiting.push_back(detectionsAt(late.frame, boxesFrom(bodyAt(late.x), late.frame)));
      if (waiting.size() > 3) late.filter.onDetections(waiting.front()), waiting.pop_front();
      late.talk();
    }
  };
  frames(200), frames(10), frames(14);
  for (const auto& d : waiting) late.filter.onDetections(d);
  ASSERT_GT(late.filter.reasons().of("detections_late"), 100u);
  EXPECT_EQ(late.count(EventKind::kArchived), 3u);
  const auto &a = on_time.filter.belief().objects, &b = late.filter.belief().objects;
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GE(a.size(), 3u);
  for (std::size_t j = 0; j < a.size(); ++j) {
    EXPECT_EQ(a[j].id, b[j].id);
    EXPECT_EQ(a[j].existence, b[j].existence);
    EXPECT_EQ(a[j].best().x, b[j].best().x);
    EXPECT_EQ(a[j].best().P, b[j].best().P);
  }
}

TEST(LongTermMemory, ANewbornWhereTheRecalledOneStandsBecomesTheRecalledOne) {
  Pair pair;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(200, 2.0);
  ASSERT_TRUE(pair.confirmed().empty());
  pair.deaf = true;  // the map is slow: the cars are born again
  pair.driveTo(-6, 2.0);
  pair.driveTo(4);
  const auto again = pair.confirmed();
  ASSERT_GE(again.size(), 2u);
  for (const ObjectId id : again) EXPECT_FALSE(street.contains(id));
  pair.deaf = false;
  pair.driveTo(14);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_GE(pair.count(EventKind::kMerged), again.size());
}

TEST(LongTermMemory, ARestartedFilterRecallsWhatItsPredecessorArchived) {
  Pair pair;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(200, 2.0);
  std::vector<Objects> objects;
  std::vector<MapQuery> queries;
  std::vector<Recalled> answers;
  Node second(configWith(kMemory), makePriors(), 10,
              {.objects = [&](const Objects& m) { objects.push_back(m); },
               .events = {},
               .predictions = {},
               .queries = [&](const MapQuery& q) { queries.push_back(q); }});
  map_store::Config store;
  store.store_path = pair.folder.file("map.sqlite");
  pair.map.reset();
  map_store::Node map(store, 6,
                      {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
                       [](const MapReply&) {}, [&](const Recalled& r) { answers.push_back(r); }});
  second.onCalibration(calibrationOf(makeCamera()));
  second.onModel(makeModelInfo());
  for (std::uint64_t k = pair.frame; k < pair.frame + 3; ++k) {
    second.onOdometry(odometryAt(k, bodyAt(80)));
    second.flush();
    for (const auto& q : std::exchange(queries, {})) map.onQuery(q);
    for (const auto& r : std::exchange(answers, {})) second.onRecalled(r);
  }
  std::set<ObjectId> back;
  for (const auto& o : objects.back().objects) back.insert(o.id);
  EXPECT_EQ(back, street);
  EXPECT_GT(objects.back().next_id, *street.rbegin());
}

TEST(LongTermMemory, AnswersThatNobodyAskedForAreCountedAndChangeNothing) {
  Pair pair;
  pair.driveTo(14);
  Recalled answer;
  answer.world = {5, 0};
  answer.client = 9;
  answer.request = 4711;
  answer.objects = pair.objects.back().objects;
  for (auto& o : answer.objects) o.id += 100;
  const std::size_t size = pair.filter.belief().objects.size();
  pair.filter.onRecalled(answer);
  EXPECT_EQ(pair.filter.reasons().of("recalled_unasked"), 1u);
  answer.client = 77;
  pair.filter.onRecalled(answer);
  EXPECT_EQ(pair.filter.reasons().of("recalled_unasked"), 1u);
  answer.client = 9;
  answer.world = {6, 0};
  pair.filter.onRecalled(answer);
  EXPECT_EQ(pair.filter.reasons().of("recalled_of_other_world"), 1u);
  EXPECT_EQ(pair.filter.belief().objects.size(), size);
}

/// Cars at uneven gaps and a few people, on both sides of 120 m.
std::vector<TrueObject> longStreet(double least_gap = 7.0) {
  std::vector<TrueObject> things;
  std::mt19937 random(3);
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

/// Odometry lost its frame of reference: from here on it is another one.
void beginAnew(Pair& pair) {
  ++pair.world.epoch;
  pair.T_W = RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(2.2, Eigen::Vector3d::UnitZ())),
                            {140.0, -35.0, 2.0});
}

/// The id under which each of the things is claimed, by its number; 0 where it is not.
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

TEST(LongTermMemory, WhatWasKnownKeepsItsIdWhereOdometryBeginsAnew) {
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
  EXPECT_TRUE(pair.filter.note().empty());
}

TEST(LongTermMemory, WhatWaitedOnTheMapComesBackIntoTheNewFrameOfReference) {
  Pair pair(configWith({true, 40.0, 10.0, 2.0}), longStreet());
  pair.driveTo(30);
  const auto early = idsOf(pair);
  pair.driveTo(110);
  ASSERT_GE(pair.count(EventKind::kArchived), 4u);
  beginAnew(pair);
  pair.driveTo(60);
  ASSERT_TRUE(pair.filter.note().empty()) << pair.filter.note();
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

TEST(LongTermMemory, TheNextDayFindsTheMapOfTheDayBefore) {
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

/// Mean distance between the things and what is claimed of them, where odometry has them now, after
/// it drifted for a while: the street is driven to and fro.
double errorAfterDrift(const Config& config) {
  Pair pair(config, longStreet(4.5));
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

TEST(LongTermMemory, ThingsStayWhereTheyAreBesideTheBodyWhileOdometryDrifts) {
  Config config = configWith(kMemory);
  config.filter.pose.walk_position = 0.03;
  config.filter.pose.walk_rotation = 0.0007;
  config.filter.motion.position_walk = 0.002;  // things do not follow by themselves
  const double error = errorAfterDrift(config);
  config.filter.drift.things = 1000000;
  const double without = errorAfterDrift(config);
  EXPECT_LT(error, 0.85 * without) << error << " m, without " << without << " m";
}

TEST(LongTermMemory, AnotherPlaceIsNotTakenForTheMapOfBefore) {
  Pair pair(configWith(kMemory), longStreet());
  pair.driveTo(60);
  const auto before = pair.confirmed();
  beginAnew(pair);
  for (std::size_t i = 0; i < pair.things.size(); ++i) {  // other gaps, some of another class
    pair.things[i].x[0] += 5.0 * std::sin(2.7 * static_cast<double>(i));
    pair.things[i].x[1] *= 1.0 + 0.4 * std::cos(1.9 * static_cast<double>(i));
  }
  pair.driveTo(20);
  pair.driveTo(60);
  for (const ObjectId id : pair.confirmed()) EXPECT_FALSE(before.contains(id)) << id;
  EXPECT_EQ(pair.filter.note(), "looks for 13 things of the map of before");
}

}  // namespace
}  // namespace perdure::semantic_filter

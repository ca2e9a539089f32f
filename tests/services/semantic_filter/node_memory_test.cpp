// Tracks that leave the working set for the map and are recalled, with the real map store behind
// the node.
#include <gtest/gtest.h>

#include <cstring>
#include <deque>
#include <set>
#include <utility>
#include <vector>

#include "services/semantic_filter/events.h"
#include "tests/services/semantic_filter/memory_run.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

/// The graph does not move objects of the map, and their places are certain.
struct PrecisePair : Pair {
  explicit PrecisePair(bool graph = true) : Pair(configWith(kMemory), kStreet, graph) {
    precise = true;
  }
};

bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(NodeMemory, AFarTrackIsArchivedAndRecalledUnderItsId) {
  PrecisePair pair;
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

void expectRecallBitForBit(bool graph) {
  PrecisePair pair(graph);
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
  // The cross-covariance with the pose error refers to the same error as before.
  EXPECT_NE(pair.filter.belief().tracks[0].pose_product, Matrix6d::Identity());
}

TEST(NodeMemory, ABeliefIsRecalledBitForBitAndItsLedgerSaysSo) { expectRecallBitForBit(true); }

TEST(NodeMemory, ABeliefIsRecalledBitForBitWithoutAGraphToo) { expectRecallBitForBit(false); }

TEST(NodeMemory, NothingIsArchivedWhileNoMapStoreAnswers) {
  PrecisePair pair(false);
  pair.deaf = true;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(300, 2.0);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_EQ(pair.count(EventKind::kArchived), 0u);
  pair.deaf = false;  // the map store starts: it receives the working set before any track leaves
  pair.driveTo(360, 2.0);
  EXPECT_TRUE(pair.confirmed().empty());
  pair.driveTo(100, 2.0);
  EXPECT_EQ(pair.confirmed(), street);
}

TEST(NodeMemory, TheStatesOfArchivedObjectsAreDisposed) {
  PrecisePair pair;
  pair.driveTo(14);
  pair.driveTo(200, 2.0);
  ObjectStates states;
  std::size_t gone = 0;
  for (const Objects& m : pair.objects) gone += states.update(m).gone.size();
  EXPECT_EQ(gone, 3u);
}

TEST(NodeMemory, LateDetectionsAcrossAnArchivingGiveThePosteriorOfThoseOnTime) {
  PrecisePair on_time, late;
  on_time.driveTo(14), late.driveTo(14);
  std::deque<Detections> waiting;
  const auto frames = [&](double until) {
    on_time.driveTo(until, 2.0);
    const double way = until > late.x ? 2.0 : -2.0;
    for (; std::abs(until - late.x) > 1.0; late.x += way, ++late.frame) {
      late.move();
      waiting.push_back(detectionsAt(late.frame, boxesFrom(bodyAt(late.x), late.frame)));
      if (waiting.size() > 3) late.filter.onDetections(waiting.front()), waiting.pop_front();
      late.talk();
    }
  };
  frames(200), frames(10), frames(14);
  for (const auto& d : waiting) late.filter.onDetections(d);
  ASSERT_GT(late.filter.reasons().of("detections_late"), 100u);
  EXPECT_EQ(late.count(EventKind::kArchived), 3u);
  const auto &a = on_time.filter.belief().tracks, &b = late.filter.belief().tracks;
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GE(a.size(), 3u);
  for (std::size_t j = 0; j < a.size(); ++j) {
    EXPECT_EQ(a[j].id, b[j].id);
    EXPECT_EQ(a[j].existence, b[j].existence);
    EXPECT_EQ(a[j].best().x, b[j].best().x);
    EXPECT_EQ(a[j].best().P, b[j].best().P);
  }
}

TEST(NodeMemory, ANewTrackInThePlaceOfARecalledOneMergesIntoIt) {
  PrecisePair pair;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(200, 2.0);
  ASSERT_TRUE(pair.confirmed().empty());
  pair.deaf = true;  // the map store is slow: the cars are initiated again
  pair.driveTo(-6, 2.0);
  pair.driveTo(4);
  const auto again = pair.confirmed();
  ASSERT_GE(again.size(), 2u);
  for (const ObjectId id : again) EXPECT_FALSE(street.contains(id));
  pair.deaf = false;
  pair.driveTo(14);
  EXPECT_EQ(pair.confirmed(), street);
  EXPECT_GE(pair.count(EventKind::kMerged), again.size());
  std::set<TrackId> into;
  for (const Objects& m : pair.objects) {
    for (const EndedTrack& e : m.ended) into.insert(e.into);
  }
  for (const TrackId id : into) EXPECT_TRUE(street.contains(id)) << id;
}

TEST(NodeMemory, ARestartedFilterRecallsWhatItsPredecessorArchived) {
  PrecisePair pair;
  pair.driveTo(14);
  const auto street = pair.confirmed();
  pair.driveTo(200, 2.0);
  std::vector<Objects> objects;
  std::vector<MapNear> answers;
  Node second(configWith(kMemory), makePriors(), 10,
              {.objects = [&](const Objects& m) { objects.push_back(m); },
               .events = {},
               .predictions = {}});
  pair.map.reset();
  map_store::Node map(Pair::storeIn(pair.folder), 6,
                      Pair::outputsTo([&](const MapNear& n) { answers.push_back(n); }));
  const auto exchange = [&] {
    for (const MapNear& n : std::exchange(answers, {})) second.onNear(n);
  };
  map.onQuery(Pair::helloOf(second));
  exchange();
  second.onCalibration(calibrationOf(makeCamera()));
  second.onModel(makeModelInfo());
  for (std::uint64_t k = pair.frame; k < pair.frame + 3; ++k) {
    const Odometry odometry = odometryAt(k, bodyAt(80));
    map.onOdometry(odometry);
    second.onOdometry(odometry);
    second.flush();
    map.onObjects(objects.back());
    exchange();
  }
  std::set<ObjectId> back;
  for (const auto& o : objects.back().objects) back.insert(o.id);
  EXPECT_EQ(back, street);
  EXPECT_GT(objects.back().next_id, *street.rbegin());
}

TEST(NodeMemory, ARestartedFilterHasTheWorkingSetOfItsPredecessorInItsFirstMessage) {
  PrecisePair pair;
  pair.driveTo(14);
  std::set<ObjectId> before;
  for (const auto& o : pair.objects.back().objects) before.insert(o.id);
  ASSERT_GE(before.size(), 3u);
  std::vector<Objects> objects;
  std::vector<Event> events;
  std::vector<MapNear> answers;
  Node second(configWith(kMemory), makePriors(), 10,
              {.objects = [&](const Objects& m) { objects.push_back(m); },
               .events = [&](const Event& e) { events.push_back(e); },
               .predictions = {}});
  pair.map.reset();
  map_store::Node map(Pair::storeIn(pair.folder), 6,
                      Pair::outputsTo([&](const MapNear& n) { answers.push_back(n); }));
  map.onQuery(Pair::helloOf(second));
  ASSERT_EQ(answers.size(), 1u);
  second.onNear(answers.front());
  second.onCalibration(calibrationOf(makeCamera()));
  second.onModel(makeModelInfo());
  second.onOdometry(odometryAt(pair.frame, bodyAt(pair.x)));
  second.flush();
  std::set<ObjectId> after;
  for (const auto& o : objects.back().objects) after.insert(o.id);
  EXPECT_EQ(after, before);
  EXPECT_GE(objects.back().next_id, pair.objects.back().next_id);
  for (const Event& e : events) EXPECT_NE(e.kind, EventKind::kBorn);
}

}  // namespace
}  // namespace perdure::semantic_filter

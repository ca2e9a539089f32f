// Map objects near the body, in the filter that receives them. The test acts as the map.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "tests/services/semantic_filter/memory_run.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

constexpr ObjectId kKnown = 900, kNext = 1000;

/// A car of the map, as the store sends it: relative to the body.
ObjectBelief knownCar(ObjectId id, const Eigen::Vector3d& p, const std::string& name = "car") {
  ObjectBelief belief = map_store::test::carAt(id, p, name);
  belief.recalled = true;
  belief.memory = Memory::kLongTerm;
  for (ClassBelief& c : belief.classes) {
    c.mean.head<3>() = p;
    c.covariance = 0.04 * Matrix7d::Identity();
    c.cross_pose.setZero();
  }
  return belief;
}

/// A filter on the street. The map assigned the ids below kNext, so its objects are older.
struct Street : Pair {
  std::uint64_t revision = 0;

  explicit Street(const Config& config = configWith(kMemory),
                  const std::vector<TrueObject>& street = kStreet)
      : Pair(config, street) {
    deaf = true;
    send();
  }
  MapNear near(std::vector<ObjectBelief> placed = {}, std::vector<Member> members = {}) {
    MapNear near;
    near.instance = 6;
    near.client = 9;
    near.world = {5, 0};
    near.revision = ++revision;
    near.next_id = kNext;
    near.placed = std::move(placed);
    near.members = std::move(members);
    return near;
  }
  MapNear send(std::vector<ObjectBelief> placed = {}, std::vector<Member> members = {}) {
    const MapNear message = near(std::move(placed), std::move(members));
    filter.onNear(message);
    return message;
  }
  void frames(int count) {
    for (; count > 0; --count) driveTo(x + 0.4);
  }
  const Track* track(TrackId id) const {
    for (const Track& t : filter.belief().tracks) {
      if (t.id == id) return &t;
    }
    return nullptr;
  }
  /// The object as last published.
  const ObjectBelief* object(ObjectId id) const {
    for (const ObjectBelief& o : objects.back().objects) {
      if (o.id == id) return &o;
    }
    return nullptr;
  }
  /// A confirmed track of the street.
  ObjectBelief seen(const std::string& name = "car") const {
    for (const ObjectBelief& o : objects.back().objects) {
      if (o.confirmed && !o.recalled && o.best().name == name) return o;
    }
    ADD_FAILURE() << "no " << name;
    return objects.back().objects.front();
  }
  /// The absorbed ids, each with the id that survived.
  std::vector<std::pair<ObjectId, ObjectId>> merged() const {
    std::vector<std::pair<ObjectId, ObjectId>> pairs;
    for (const Event& e : events) {
      if (e.kind == EventKind::kMerged) pairs.emplace_back(e.object_id, e.other_id);
    }
    return pairs;
  }
};
using Merged = std::vector<std::pair<ObjectId, ObjectId>>;

/// A position without cars and outside the camera's view.
const Eigen::Vector3d kBehind(2.0, -9.0, 0.75);

Eigen::Vector3d beside(const ObjectBelief& object) {
  return object.best().mean.head<3>() + Eigen::Vector3d(0.3, -0.2, 0.0);
}

TEST(NodeNear, APlacedObjectIsAsUncertainAsTheBodyAndSharesItsError) {
  Config config = configWith(kMemory);
  config.filter.pose.walk_position = 0.03;
  config.filter.pose.walk_rotation = 0.001;
  Street run(config);
  run.driveTo(14);
  const ObjectBelief car = knownCar(kKnown, kBehind);
  run.send({car});
  run.frames(1);
  const Objects now = run.objects.back();
  ASSERT_GT(now.pose_error.trace(), 1e-6) << "a pose with an error";
  const Track* track = run.track(kKnown);
  ASSERT_NE(track, nullptr);
  EXPECT_TRUE(track->life.recalled);
  EXPECT_TRUE(track->life.confirmed);
  EXPECT_EQ(run.filter.belief().tracks.front().id, kKnown) << "in order of id";
  Track expected = fromBelief(car, Matrix6d::Identity(), ExistenceEvidence::kRecall);
  for (std::size_t i = 0; i < expected.hypotheses.size(); ++i) {
    Hypothesis h = expected.hypotheses[i];
    addPoseError(h, now.T_WB, now.up_W, now.pose_error);
    EXPECT_EQ(track->hypotheses[i].x, h.x);
    EXPECT_EQ(track->hypotheses[i].C, h.C);
    EXPECT_EQ(track->hypotheses[i].P, h.P);
  }
  run.driveTo(15);
  EXPECT_EQ(run.count(EventKind::kRecalled), 1u);
}

TEST(NodeNear, ATrackOfAKnownObjectIsFusedWithItAndPublishedUnderTheOlderId) {
  Street run;
  run.driveTo(14);
  const ObjectBelief seen = run.seen();
  const std::size_t before = run.confirmed().size();
  run.send({knownCar(kKnown, beside(seen))}, {{seen.id, kKnown}});
  run.frames(1);
  EXPECT_EQ(run.track(kKnown), nullptr);
  const Track* track = run.track(seen.id);
  ASSERT_NE(track, nullptr) << "it keeps its track id";
  EXPECT_FALSE(track->life.recalled);
  EXPECT_LT(track->best().P(0, 0) + track->best().P(1, 1), 0.2);
  run.driveTo(16);
  ASSERT_NE(run.object(kKnown), nullptr);
  EXPECT_EQ(run.object(kKnown)->track, seen.id);
  EXPECT_EQ(run.object(seen.id), nullptr);
  EXPECT_EQ(run.confirmed().size(), before);
  EXPECT_TRUE(std::is_sorted(run.objects.back().objects.begin(), run.objects.back().objects.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
  EXPECT_EQ(run.merged(), (Merged{{kKnown, seen.id}}));
  EXPECT_TRUE(run.objects.back().ended.empty()) << "the map has said it";
  EXPECT_EQ(run.count(EventKind::kGone), 0u);
}

TEST(NodeNear, AKnownTrackThatIsFusedIsReportedOnceAlsoIfItIsTheYoungerOne) {
  Street run;
  run.driveTo(14);
  const ObjectBelief seen = run.seen();
  run.send({knownCar(5000, kBehind)});
  run.frames(1);
  ASSERT_NE(run.object(5000), nullptr);
  run.send({}, {{5000, seen.id}});
  run.frames(2);
  EXPECT_EQ(run.object(5000), nullptr);
  ASSERT_NE(run.object(seen.id), nullptr);
  EXPECT_EQ(run.merged(), (Merged{{seen.id, 5000}}));
  EXPECT_TRUE(run.objects.back().ended.empty());
}

TEST(NodeNear, AJoinWithoutAKnownTrackIsReportedOnce) {
  Street run;
  run.driveTo(14);
  const ObjectBelief seen = run.seen();
  for (int i = 0; i < 3; ++i) {
    run.send({}, {{seen.id, kKnown}});
    run.frames(1);
  }
  ASSERT_NE(run.object(kKnown), nullptr);
  EXPECT_EQ(run.object(kKnown)->track, seen.id);
  EXPECT_EQ(run.merged(), (Merged{{kKnown, seen.id}}));
}

TEST(NodeNear, AJoinThatIsWithdrawnGivesTheYoungerIdBackAndTheOlderObjectIsPlacedWhereItIs) {
  Street run;
  run.driveTo(14);
  const ObjectBelief seen = run.seen();
  run.send({knownCar(kKnown, beside(seen))}, {{seen.id, kKnown}});
  run.driveTo(16);
  ASSERT_EQ(run.object(seen.id), nullptr);
  const std::size_t born = run.count(EventKind::kBorn);
  const MapNear withdrawn = run.send({knownCar(kKnown, kBehind)});
  run.frames(1);
  ASSERT_NE(run.object(seen.id), nullptr);
  EXPECT_EQ(run.object(seen.id)->trackId(), seen.id);
  const Track* track = run.track(seen.id);
  EXPECT_LT((track->best().x.head<3>() - seen.best().mean.head<3>()).norm(), 0.5);
  EXPECT_FALSE(track->life.recalled);
  ASSERT_NE(run.track(kKnown), nullptr);
  EXPECT_LT((run.track(kKnown)->best().x.head<3>() - kBehind).norm(), 1e-9);
  run.driveTo(18);
  EXPECT_NE(run.object(seen.id), nullptr);
  EXPECT_EQ(run.count(EventKind::kBorn), born) << "it is no new object";
  run.filter.onNear(withdrawn);
  EXPECT_EQ(run.filter.reasons().of("near_repeated"), 1u);
  run.frames(1);
  EXPECT_NE(run.object(seen.id), nullptr);
  EXPECT_EQ(run.merged().size(), 1u);
}

TEST(NodeNear, LateDetectionsGiveTheBeliefOfThoseOnTimeAlsoAcrossAJoin) {
  Street on_time, late;
  std::deque<Detections> waiting;
  on_time.driveTo(14), late.driveTo(14);
  const ObjectBelief seen = late.seen();
  const auto join = [&](Street& run) {
    run.send({knownCar(kKnown, beside(seen))}, {{seen.id, kKnown}});
  };
  for (int i = 0; i < 6; ++i) {
    for (Street* run : {&on_time, &late}) {
      run->filter.onOdometry(odometryAt(run->frame, bodyAt(run->x)));
      if (i == 3) join(*run);
      const auto boxes = detectionsAt(run->frame, boxesFrom(bodyAt(run->x), run->frame));
      run == &late ? waiting.push_back(boxes) : run->filter.onDetections(boxes);
      run->x += 0.4, ++run->frame;
    }
  }
  for (const Detections& d : waiting) late.filter.onDetections(d);
  ASSERT_GT(late.filter.reasons().of("detections_late"), 0u);
  on_time.driveTo(18), late.driveTo(18);
  const auto &a = on_time.filter.belief().tracks, &b = late.filter.belief().tracks;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t j = 0; j < a.size(); ++j) {
    EXPECT_EQ(a[j].id, b[j].id);
    EXPECT_EQ(a[j].existence, b[j].existence);
    EXPECT_EQ(a[j].best().x, b[j].best().x);
    EXPECT_EQ(a[j].best().P, b[j].best().P);
    EXPECT_EQ(a[j].best().C, b[j].best().C);
  }
  EXPECT_EQ(late.track(kKnown), nullptr);
  EXPECT_NE(late.object(kKnown), nullptr);
  EXPECT_EQ(late.merged(), (Merged{{kKnown, seen.id}}));
}

TEST(NodeNear, MembersThatAreNotInTheWorkingSetChangeNothing) {
  Street run;
  run.driveTo(14);
  const auto before = run.confirmed();
  const ObjectId seen = *before.begin();
  run.send({}, {{700, 600}, {5001, seen}, {5002, 700}});
  run.driveTo(15);
  EXPECT_EQ(run.confirmed(), before);
  EXPECT_EQ(run.count(EventKind::kMerged), 0u);
}

TEST(NodeNear, AnUnseenTrackIsPlacedAgainAndADetectedOneStays) {
  Street run;
  run.driveTo(14);
  run.send({knownCar(kKnown, kBehind)});
  run.driveTo(15);
  const Eigen::Vector3d better = kBehind + Eigen::Vector3d(0.8, 0.5, 0.0);
  const ObjectBelief seen = run.seen();
  const Eigen::Vector3d place = seen.best().mean.head<3>();
  ASSERT_FALSE(run.track(seen.id)->life.recalled);
  const std::size_t count = run.filter.belief().tracks.size();
  run.send({knownCar(kKnown, better), knownCar(seen.id, place + Eigen::Vector3d(1.5, 0, 0))});
  run.frames(1);
  EXPECT_EQ(run.filter.belief().tracks.size(), count);
  EXPECT_LT((run.track(kKnown)->best().x.head<3>() - better).norm(), 1e-12);
  EXPECT_LT((run.track(seen.id)->best().x.head<3>() - place).norm(), 0.2);
  run.driveTo(16);
  EXPECT_EQ(run.count(EventKind::kRecalled), 1u) << "it came once";
  ASSERT_NE(run.track(kKnown), nullptr);
  EXPECT_LT((run.track(kKnown)->best().x.head<3>() - better).norm(), 0.2);
}

TEST(NodeNear, AnUnseenTrackOfAnotherKindLeavesAndTheDetectedOneHasTheId) {
  Street run;
  run.driveTo(14);
  const ObjectBelief seen = run.seen();
  for (int i = 0; i < 2; ++i) {
    run.send({knownCar(kKnown, beside(seen), "van")}, {{seen.id, kKnown}});
    run.frames(1);
    EXPECT_EQ(run.track(kKnown), nullptr);
    ASSERT_NE(run.object(kKnown), nullptr);
    EXPECT_EQ(run.object(kKnown)->track, seen.id);
    EXPECT_EQ(run.object(kKnown)->best().name, "car");
  }
  EXPECT_EQ(run.merged(), (Merged{{kKnown, seen.id}}));
}

TEST(NodeNear, OfTwoDetectedTracksOfDifferentKindsOneAloneHasTheIdOfTheirObject) {
  const std::vector<TrueObject> street = {{makeState(18, 3.5, 0.75, 0.1, 4.3, 1.75, 1.5), "car"},
                                          {makeState(22, -4.0, 1.05, 3.0, 5.0, 1.9, 2.1), "van"}};
  Street run(configWith(kMemory), street);
  run.driveTo(14);
  const ObjectId car = run.seen("car").id, van = run.seen("van").id;
  const ObjectId first = std::min(car, van), second = std::max(car, van);
  run.send({}, {{second, first}});
  run.frames(1);
  ASSERT_NE(run.object(first), nullptr);
  EXPECT_EQ(run.object(first)->trackId(), first);
  ASSERT_NE(run.object(second), nullptr) << "it goes on under its own id";
  run.send({}, {{first, kKnown}, {second, kKnown}});
  run.frames(1);
  ASSERT_NE(run.object(kKnown), nullptr);
  EXPECT_EQ(run.object(kKnown)->track, first);
  EXPECT_EQ(run.object(first), nullptr);
  ASSERT_NE(run.object(second), nullptr);
  EXPECT_EQ(run.object(second)->trackId(), second);
}

TEST(NodeNear, WhatIsForAnotherFilterOrAnotherWorldIsNotUsed) {
  Street run;
  run.driveTo(14);
  const std::size_t count = run.filter.belief().tracks.size();
  MapNear other = run.near({knownCar(kKnown, kBehind)});
  other.client = 77;
  run.filter.onNear(other);
  other.client = 9;
  other.world = {6, 0};
  run.filter.onNear(other);
  run.frames(1);
  EXPECT_EQ(run.filter.belief().tracks.size(), count);
  EXPECT_EQ(run.filter.reasons().of("near_of_other_world"), 1u);
  EXPECT_EQ(run.objects.back().near_revision, other.revision - 1);
}

TEST(NodeNear, AnOlderStateIsIgnoredAndTheNewestBeforeAFrameIsUsed) {
  Street run;
  run.driveTo(14);
  const MapNear first = run.near({knownCar(kKnown, kBehind)}), second = run.near();
  run.filter.onNear(second);
  run.filter.onNear(first);
  EXPECT_EQ(run.filter.reasons().of("near_repeated"), 1u);
  run.frames(1);
  EXPECT_EQ(run.track(kKnown), nullptr);
  run.send({knownCar(kKnown, kBehind)});
  const MapNear newest = run.send({knownCar(kKnown + 1, kBehind)});
  run.frames(1);
  EXPECT_EQ(run.track(kKnown), nullptr);
  EXPECT_NE(run.track(kKnown + 1), nullptr);
  EXPECT_EQ(run.objects.back().near_source, newest.instance);
  EXPECT_EQ(run.objects.back().near_revision, newest.revision);
  EXPECT_DOUBLE_EQ(run.objects.back().near_m, kMemory.recall_m + kMemory.margin_m / 3.0);
}

TEST(NodeNear, MalformedObjectsAreCountedAndTheOthersAreUsed) {
  Street run;
  run.driveTo(14);
  ObjectBelief without_id = knownCar(0, kBehind), without_class = knownCar(kKnown + 1, kBehind);
  without_class.classes.clear();
  run.send({without_id, without_class, knownCar(kKnown, kBehind)});
  run.frames(1);
  EXPECT_EQ(run.filter.reasons().of("near_malformed"), 2u);
  EXPECT_NE(run.track(kKnown), nullptr);
  EXPECT_EQ(run.track(kKnown + 1), nullptr);
}

TEST(NodeNear, IdsThatTheMapKnowsAreNotDrawnAgain) {
  Street run;
  ObjectBelief joined = knownCar(kKnown, kBehind);
  joined.track = 6000;
  run.send({knownCar(5000, kBehind + Eigen::Vector3d(0, -9, 0)), joined}, {{6000, kKnown}});
  run.driveTo(14);
  EXPECT_GT(run.objects.back().next_id, 6000u);
  std::size_t drawn = 0;
  for (const Event& e : run.events) {
    if (e.kind != EventKind::kBorn) continue;
    EXPECT_GT(e.object_id, 6000u);
    ++drawn;
  }
  EXPECT_GE(drawn, 3u);
  MapNear other = run.near();
  other.world = {6, 0};
  other.next_id = 8000;
  run.filter.onNear(other);
  run.frames(1);
  EXPECT_GE(run.objects.back().next_id, 8000u) << "a state of another world takes ids, too";
}

/// A car that drives off behind the body and was last detected now.
ObjectBelief leaving(ObjectId id, const FrameStamp& now, double y) {
  ObjectBelief car = knownCar(id, {-40.0, y, 0.75});
  car.moving = 0.99;
  car.velocity << -40.0, 0.0, 0.0;
  car.last_seen = car.as_of = now.time;
  return car;
}

TEST(NodeNear, EndedTracksArePublishedUntilTheMapHasThemOnDisk) {
  Street run(configWith(kMemory), {});
  run.frames(30);
  const FrameStamp now = run.objects.back().stamp;
  run.send({leaving(1, now, 0.0), leaving(2, now, 9.0)});
  run.frames(1);
  ASSERT_NE(run.object(1), nullptr);
  EXPECT_TRUE(run.objects.back().ended.empty());
  run.frames(60);
  ASSERT_EQ(run.object(1), nullptr);
  const auto ended = run.objects.back().ended;
  ASSERT_EQ(ended.size(), 2u);
  EXPECT_EQ(ended[0].track, 1u);
  EXPECT_EQ(ended[1].track, 2u);
  EXPECT_EQ(ended[0].into, 0u);
  EXPECT_EQ(run.count(EventKind::kGone), 2u);
  MapNear near = run.near();
  near.kept = ended[0].time - std::chrono::nanoseconds(1);
  run.filter.onNear(near);
  run.frames(1);
  EXPECT_EQ(run.objects.back().ended, ended);
  near = run.near();
  near.kept = ended[0].time;
  run.filter.onNear(near);
  run.frames(1);
  EXPECT_TRUE(run.objects.back().ended.empty());
}

TEST(NodeNear, TheNewestOfTooManyEndedTracksArePublished) {
  Street run(configWith(kMemory), {});
  run.frames(30);
  const FrameStamp now = run.objects.back().stamp;
  std::vector<ObjectBelief> many;
  for (ObjectId id = 1; id <= kMostEnded + 50; ++id) {
    many.push_back(leaving(id, now, 9.0 * (static_cast<double>(id) - 150.0)));
  }
  run.send(many);
  run.frames(61);
  ASSERT_TRUE(run.objects.back().objects.empty());
  const auto& ended = run.objects.back().ended;
  ASSERT_EQ(ended.size(), kMostEnded);
  EXPECT_EQ(ended.front().track, 51u);
  EXPECT_EQ(ended.back().track, kMostEnded + 50);
}

/// A table that the image border cuts, and a chair, object kKnown, that hides most of it.
struct ChairBeforeTable : Street {
  static constexpr TrackId kTable = 1001, kChair = 1002;

  ChairBeforeTable()
      : Street(configWith(kMemory),
               {{makeState(8.3, -6.6, 0.37, 0, 0.8, 1.5, 0.74), "dining table"},
                {makeState(6.9, -4.9, 0.59, 0, 0.5, 0.75, 0.64), "chair"}}) {
    std::vector<ObjectBelief> placed;
    for (std::size_t i = 0; i < things.size(); ++i) {
      Track track = makeObject(kTable + i, things[i].class_name, things[i].x, 1e-4);
      track.life.confirmed = true;
      placed.push_back(toBelief(track, makePriors(), 0.7));
    }
    send(placed, {{kChair, kKnown}});
    filter.onOdometry(odometryAt(0, bodyAt(0)));
    filter.flush();
  }
  /// The chair's existence after a frame without boxes, except this answer to a prediction of the
  /// chair.
  double chairAfter(std::optional<ObjectId> primed_for) {
    View view;
    const CameraModel camera{makeCamera()};
    view.camera = &camera;
    view.T_WB = bodyAt(0);
    std::mt19937 random(1);
    std::vector<Detection> boxes;
    if (primed_for) {
      boxes.push_back(*detect(things[1], view, BoxParameters{}, 0.0, 3.0, random));
      boxes.back().primed = true;
      boxes.back().primed_for = *primed_for;
    }
    filter.onOdometry(odometryAt(1, bodyAt(0)));
    filter.onDetections(detectionsAt(1, boxes));
    return track(kChair)->existence;
  }
};

TEST(NodeNear, OccludersAndPredictionsAreNamedByTheIdsOfObjects) {
  ChairBeforeTable run;
  ASSERT_EQ(run.objects.back().objects.size(), 2u);
  ASSERT_NE(run.object(kKnown), nullptr);
  EXPECT_EQ(run.object(kKnown)->track, ChairBeforeTable::kChair);
  const ObjectBelief* table = run.object(ChairBeforeTable::kTable);
  ASSERT_NE(table, nullptr);
  EXPECT_EQ(table->track, 0u) << "the same as its id";
  EXPECT_EQ(table->visibility, Visibility::kOccluded);
  EXPECT_EQ(table->blocked_by, kKnown);
  std::set<ObjectId> predicted;
  for (const Prediction& p : run.predictions.predictions) predicted.insert(p.object_id);
  EXPECT_TRUE(predicted.contains(kKnown));
  EXPECT_FALSE(predicted.contains(ChairBeforeTable::kChair));
}

TEST(NodeNear, AnAnswerToAPredictionOfAnObjectIsOfItsTrack) {
  const double unanswered = ChairBeforeTable().chairAfter({});
  const double answered = ChairBeforeTable().chairAfter(kKnown);
  EXPECT_GT(answered, unanswered);
  EXPECT_EQ(ChairBeforeTable().chairAfter(77), unanswered);
  EXPECT_EQ(ChairBeforeTable().chairAfter(ChairBeforeTable::kChair), answered)
      << "asked before the map has joined them";
}

}  // namespace
}  // namespace perdure::semantic_filter

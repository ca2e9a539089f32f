// Objects that the map store gives by its graph: objects of this drive that are near again, and
// objects of earlier visits near the body after a loop closure. Also the part of this that is
// stored in the file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "services/map_store/core/schema.h"
#include "tests/services/map_store/lap_drive.h"

namespace perdure::map_store {
namespace {

using namespace test;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

class NearByGraph : public LapDrive {
 protected:
  /// A drive along a straight street and back.
  void onAStreet(double length_m) {
    path_ = [length_m](double way_m) {
      const double s = std::fmod(way_m, 2.0 * length_m);
      return s < length_m ? planar(s, 0.0, 0.0) : planar(2.0 * length_m - s, 0.5, std::numbers::pi);
    };
    things_ = things([](double s) { return planar(s + 6.0, 0.0, 0.0); }, length_m);
    drift_ = 2e-5;
    config_.mapping.anchor.walk_yaw = 2e-4;
  }
};

TEST_F(NearByGraph, ALoopPlacesTheFirstLapBesideTheBodyAndJoinsWhatIsOne) {
  start();
  driveTo(kLap_m - 40.0);
  for (const MapNear& near : nears_) {
    EXPECT_THAT(near.members, IsEmpty());
    EXPECT_THAT(near.placed, IsEmpty());
  }
  const MapNear near = driveToTheLoop();
  EXPECT_TRUE(near.corrects_drift);
  EXPECT_EQ(near.client, 11u);
  EXPECT_EQ(near.world, kHere);
  EXPECT_EQ(near.next_id, next_id_);
  const RigidTransform T_BM = onLap(way_m_).inverse();
  ASSERT_GT((T_WB_.p - onLap(way_m_).p).norm(), 1.0) << "a drift that shows";

  ASSERT_THAT(near.members, Not(IsEmpty()));
  for (const Member& member : near.members) {
    EXPECT_LT(member.object, member.track);
    EXPECT_EQ(thing_of_.at(member.object), thing_of_.at(member.track));
    EXPECT_TRUE(working_.contains(member.track));
    EXPECT_TRUE(has(near.placed, member.object)) << "what is known of it comes with it";
  }
  ASSERT_GE(near.placed.size(), 4u);
  std::set<TrackId> tracks;
  for (const ObjectBelief& belief : near.placed) {
    EXPECT_TRUE(tracks.insert(belief.track).second) << belief.track << " twice";
    EXPECT_FALSE(working_.contains(belief.track));
    const ClassBelief& best = belief.best();
    const Eigen::Vector3d placed_B = T_WB_.inverse() * Eigen::Vector3d(best.mean.head<3>());
    const Eigen::Vector3d p_B = T_BM * truthOf(belief.track);
    EXPECT_LT((placed_B - p_B).norm(), 1.5) << belief.id;
    EXPECT_EQ(best.name, things_[thing_of_.at(belief.track)].name);
    EXPECT_TRUE(best.cross_pose.isZero());
    EXPECT_GT(best.covariance(0, 0), 0.03) << "with the error of the graph";
    EXPECT_LT(best.covariance(0, 0), 3.0);
  }
}

TEST_F(NearByGraph, AfterALoopObjectsAreSeenUnderTheirOldIds) {
  start();
  driveToTheLoop();
  std::set<std::size_t> seen_before;
  for (const auto& [track, thing] : thing_of_) seen_before.insert(thing);
  const TrackId first_new = next_id_;
  driveTo(way_m_ + 60.0);
  for (const auto& [track, thing] : thing_of_) {
    EXPECT_TRUE(track < first_new || !seen_before.contains(thing))
        << "what comes in sight has its track before";
  }
  for (const auto& [thing, ids] : idsOnTheMap()) EXPECT_EQ(ids.size(), 1u) << thing;
  for (const ObjectBelief& belief : objects().objects) {
    EXPECT_EQ(idsOnTheMap().at(thing_of_.at(belief.trackId())), std::set<ObjectId>{belief.id});
  }
}

/// The body drives away and returns while its position in M remains well known.
TEST_F(NearByGraph, AnObjectThatLeftComesBackAsSoonAsItIsNearWithoutALoop) {
  onAStreet(100.0);
  start();
  driveTo(90.0);
  const ObjectId left = 1;
  ASSERT_FALSE(working_.contains(left));
  const ObjectBelief as_stored = stored(left);
  const Eigen::Vector3d p_W = as_stored.best().mean.head<3>();
  const std::size_t before = nears_.size();
  while (!givenOnceMore(left, before) && way_m_ < 200.0) step();
  EXPECT_EQ(loops(), 0u);
  EXPECT_EQ(replies_.size(), 1u) << "nobody asked";
  ASSERT_TRUE(has(nears_.back().as_published, left));
  constexpr double kStep_m = 20.0 / 3.0;
  EXPECT_LT((p_W - T_WB_.p).norm(), near_m_);
  EXPECT_GT((p_W - T_WB_.p).norm(), near_m_ - kStep_m - 1.0);
  const auto& list = nears_.back().as_published;
  const auto given =
      std::find_if(list.begin(), list.end(), [&](const ObjectBelief& o) { return o.id == left; });
  EXPECT_EQ(encodeBelief(*given), encodeBelief(as_stored)) << "bit for bit";
  const ObjectId next = next_id_;
  driveTo(200.0);
  EXPECT_EQ(next_id_, next) << "nothing is seen as new";
  EXPECT_GT(working_.at(left).last_seen, as_stored.last_seen);
  for (const auto& [thing, ids] : idsOnTheMap()) EXPECT_THAT(ids, ElementsAre(thing + 1));
}

TEST_F(NearByGraph, WhereItPlacedAnUnseenObjectIsNotWrittenOverWhatWasSeen) {
  start();
  const MapNear near = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(near);
  ASSERT_NE(unseen, nullptr);
  const TrackId id = unseen->track;
  ASSERT_EQ(unseen->id, id);
  const auto before = encodeBelief(stored(id));
  rest(1);
  ASSERT_TRUE(working_.contains(id));
  EXPECT_EQ(working_.at(id).best().mean, unseen->best().mean);
  EXPECT_EQ(encodeBelief(stored(id)), before) << "in the working set";
  working_.erase(id);
  forgetSight(id);
  rest(1);
  EXPECT_EQ(encodeBelief(stored(id)), before) << "and after it left unseen";

  rest();
  ASSERT_TRUE(working_.contains(id)) << "it is near, so it is given again";
  EXPECT_TRUE(working_.at(id).recalled);
  EXPECT_EQ(encodeBelief(stored(id)), before);
  ++sequence_;
  working_[id] = seen(id, unseen->best().mean.head<3>(), "car");
  publish();
  EXPECT_EQ(stored(id).last_seen, stamp(sequence_).time) << "seen again, it is written";
  EXPECT_NE(encodeBelief(stored(id)), before);
}

TEST_F(NearByGraph, WhatLeftUnseenIsPlacedAgainWhileItIsNear) {
  start();
  const MapNear near = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(near);
  ASSERT_NE(unseen, nullptr);
  const ObjectId id = unseen->id;
  rest(12);
  ASSERT_TRUE(working_.contains(id));
  EXPECT_FALSE(hasAny(nears_.back(), id)) << "it is there";
  const std::size_t before = nears_.size();
  working_.erase(id);
  forgetSight(id);
  rest();
  ASSERT_TRUE(givenOnceMore(id, before));
  for (std::size_t k = before; k < nears_.size(); ++k) {
    EXPECT_FALSE(has(nears_[k].as_published, id)) << "where it was, is no longer true";
  }
}

TEST_F(NearByGraph, AtRestNothingIsSentButWhatIsOnTheDisk) {
  start();
  driveToTheLoop();
  rest(20);
  const std::size_t before = nears_.size();
  ASSERT_GE(working_.size(), 8u);
  rest(100);
  const std::size_t sent = nears_.size() - before;
  EXPECT_LE(sent, 20u) << "one a commit";
  EXPECT_GE(sent, 19u);
  for (std::size_t k = before; k < nears_.size(); ++k) {
    EXPECT_GT(nears_[k].kept, nears_[k - 1].kept);
    EXPECT_THAT(nears_[k].placed, IsEmpty());
    EXPECT_THAT(nears_[k].as_published, IsEmpty());
    EXPECT_LE(nears_[k].members.size(), working_.size()) << "16 bytes each";
  }
}

TEST_F(NearByGraph, TheGraphOutlivesTheProcess) {
  onAStreet(100.0);
  start();
  driveTo(90.0);
  const ObjectBelief as_stored = stored(1);
  restartStore();
  step();
  EXPECT_TRUE(node_->mapper().holds(1));
  EXPECT_GT(node_->mapper().anchors().size(), 5u);
  near_m_ = 120.0;
  const std::size_t before = nears_.size();
  rest();
  ASSERT_TRUE(givenOnceMore(1, before));
  EXPECT_TRUE(nears_.back().corrects_drift);
  const ObjectBelief& back = working_.at(1);
  EXPECT_EQ(back.best().mean, as_stored.best().mean);
  EXPECT_EQ(back.best().covariance, as_stored.best().covariance);
  for (std::size_t k = before; k < nears_.size(); ++k) EXPECT_THAT(nears_[k].placed, IsEmpty());
}

TEST_F(NearByGraph, WithoutAGraphObjectsComeBackAsTheyWere) {
  config_.graph = false;
  start();
  driveTo(1.3 * kLap_m);
  std::size_t back = 0;
  for (const MapNear& near : nears_) {
    EXPECT_FALSE(near.corrects_drift);
    EXPECT_THAT(near.members, IsEmpty());
    EXPECT_THAT(near.placed, IsEmpty());
    back += near.as_published.size();
  }
  EXPECT_GT(back, 0u);
}

TEST_F(NearByGraph, WhatIsGoneIsNotPlaced) {
  start();
  driveTo(kLap_m - 40.0);
  end(2);
  const MapNear near = driveToTheLoop();
  ASSERT_THAT(near.placed, Not(IsEmpty()));
  EXPECT_FALSE(hasAny(near, 2));
  for (const Member& member : near.members) EXPECT_NE(member.object, 2u);
}

/// The newest track decides; an end under one id does not end the object of the other track.
TEST_F(NearByGraph, AJoinedObjectThatEndsIsGone) {
  start();
  const MapNear near = driveToTheLoop();
  ASSERT_THAT(near.members, Not(IsEmpty()));
  const Member joined = near.members.front();
  rest();
  ASSERT_TRUE(working_.contains(joined.track));
  end(joined.track);
  rest();
  EXPECT_FALSE(node_->mapper().holds(joined.object));
  EXPECT_FALSE(idsOnTheMap().contains(thing_of_.at(joined.object)));
  restartStore();
  EXPECT_FALSE(node_->mapper().holds(joined.object));
  EXPECT_FALSE(idsOnTheMap().contains(thing_of_.at(joined.object)));
}

TEST_F(NearByGraph, AJoinedObjectShowsOnceUnderItsLowerId) {
  start();
  const MapNear near = driveToTheLoop();
  ASSERT_THAT(near.members, Not(IsEmpty()));
  rest(24);
  const auto check = [&] {
    node_->flush();
    const auto in_tiles = idsInTiles();
    const MapReply all = answerTo({});
    EXPECT_EQ(in_tiles.size(), all.objects.size());
    for (const Member& member : near.members) {
      EXPECT_EQ(in_tiles.count(member.object), 1u) << member.object;
      EXPECT_EQ(in_tiles.count(member.track), 0u) << member.track;
      MapQuery query;
      query.kind = MapQueryKind::kById;
      query.object_id = member.object;
      const MapReply by_object = answerTo(query);
      query.object_id = member.track;
      const MapReply by_track = answerTo(query);
      ASSERT_EQ(by_object.objects.size(), 1u);
      ASSERT_EQ(by_track.objects.size(), 1u);
      EXPECT_EQ(by_object.objects[0].id, member.object);
      EXPECT_EQ(by_track.objects[0].id, member.object);
    }
  };
  check();
  tiles_.clear();
  restartStore();
  check();
}

/// Four fifths of a lap with a loop closure that is wrong by 25 m: by it, the first object and the
/// newest one are one object.
class NearByAWrongLoop : public NearByGraph {
 protected:
  void SetUp() override {
    start();
    driveTo(0.8 * kLap_m);
    node_->flush();
    node_.reset();
    StoreOptions options;
    options.path = config_.store_path;
    options.tile_size_m = config_.tile_size_m;
    MapDatabase database(options);
    mapping::MapState state({}, database.takeGraph().value().map);
    const mapping::AnchorId a = state.anchors().begin()->first, b = state.anchors().rbegin()->first;
    mapping::Edge edge{a, b, {}, mapping::EdgeKind::kLoop};
    const mapping::LevelPose there = state.graph().pose(b);
    edge.T_ab.mean = state.graph().pose(a).inverse() *
                     mapping::LevelPose{there.p + Eigen::Vector3d(20, 15, 0), there.yaw};
    edge.T_ab.covariance = 0.04 * Eigen::Matrix4d::Identity();
    known_ = state.records().begin()->first;
    seen_ = state.records().rbegin()->first;
    state.unite({state.addLoop(edge), known_, seen_});
    const Objects working = *database.reader().working().value();
    const mapping::Unsaved unsaved = state.unsaved();
    Batch batch;
    batch.working = &working;
    batch.graph = batch.facts = &unsaved;
    batch.identity = &state.identity();
    batch.regrouped = state.regrouped();
    ASSERT_TRUE(database.write(batch).has_value());
  }
  bool isPublished(ObjectId id) const {
    const auto all = objects().objects;
    return std::any_of(all.begin(), all.end(), [id](const ObjectBelief& o) { return o.id == id; });
  }

  ObjectId known_ = 0, seen_ = 0;
};

TEST_F(NearByAWrongLoop, AJoinedObjectShowsOnceAndAfterTheRetractionBothShowAgain) {
  tiles_.clear();
  start();
  ASSERT_TRUE(working_.contains(seen_));
  rest();
  EXPECT_THAT(nears_.back().members, Contains(Member{seen_, known_}));
  EXPECT_TRUE(isPublished(known_));
  EXPECT_FALSE(isPublished(seen_));
  node_->flush();
  EXPECT_EQ(idsInTiles().count(known_), 1u);
  EXPECT_EQ(idsInTiles().count(seen_), 0u);
  std::set<ObjectId> answered;
  for (const MapObject& o : answerTo({}).objects) answered.insert(o.id);
  EXPECT_TRUE(answered.contains(known_));
  EXPECT_FALSE(answered.contains(seen_));
  const std::size_t objects = answered.size();

  while (count(EventKind::kLoopWithdrawn) == 0 && way_m_ < 1.4 * kLap_m) step();
  ASSERT_EQ(count(EventKind::kLoopWithdrawn), 1u);
  EXPECT_EQ(objectOf(nears_.back(), seen_), seen_);
  rest(24);
  EXPECT_EQ(isPublished(seen_), working_.contains(seen_)) << "under its own id again";
  const auto ids = idsOnTheMap();
  EXPECT_THAT(ids.at(thing_of_.at(known_)), Contains(known_));
  EXPECT_THAT(ids.at(thing_of_.at(seen_)), Contains(seen_));
  EXPECT_THAT(ids.at(thing_of_.at(seen_)), Not(Contains(known_)));
  EXPECT_GT(ids.size(), objects);
  EXPECT_EQ(idsInTiles().count(known_), 1u);
  EXPECT_EQ(idsInTiles().count(seen_), 1u);
  restartStore();
  EXPECT_EQ(idsOnTheMap(), ids);
}

/// Messages between the store and the filter are lost, repeated or late.
class NearWithFaults : public NearByGraph {
 protected:
  void send(const Objects& objects) override {
    const std::vector<Objects> before = std::exchange(late_objects_, {});
    if (happens()) {
      late_objects_.push_back(objects);
    } else if (!happens()) {
      node_->onObjects(objects);
      if (happens()) node_->onObjects(objects);
    }
    for (const Objects& late : before) node_->onObjects(late);
    node_->tick(objects.stamp.time.time_since_epoch());
  }
  void hear() override {
    const std::vector<MapNear> before = std::exchange(late_nears_, {});
    for (const MapNear& near : std::exchange(coming_, {})) {
      if (happens()) {
        late_nears_.push_back(near);
      } else if (!happens()) {
        use(near);
        if (happens()) use(near);
      }
    }
    for (const MapNear& late : before) use(late);
  }
  bool happens() { return share_ > 0.0 && std::bernoulli_distribution(share_)(random_); }

  /// Ids by true object at the end of a drive, after all messages have arrived.
  std::map<std::size_t, std::set<ObjectId>> idsAfter(double way_m, std::uint32_t seed,
                                                     double share) {
    beginWith(seed, share);
    driveTo(way_m);
    return idsInTheEnd();
  }
  /// The ids that the filter publishes at the end.
  std::map<std::size_t, std::set<ObjectId>> idsInTheEnd() {
    share_ = 0.0;
    rest(12);
    const auto ids = idsOnTheMap();
    for (const ObjectBelief& belief : objects().objects) {
      EXPECT_THAT(ids.at(thing_of_.at(belief.trackId())), Contains(belief.id));
    }
    return ids;
  }
  void beginWith(std::uint32_t seed, double share) {
    random_.seed(seed);
    share_ = share;
    config_.store_path = folder_.file("map" + std::to_string(++maps_) + ".sqlite");
    beginAnew(kHere, 0.0, {});
    thing_of_.clear();
    ended_.clear();
    next_id_ = 1;
    late_objects_.clear();
    late_nears_.clear();
    near_source_ = near_revision_ = 0;
    kept_ = {};
    sequence_ = 0;
    node_.reset();
    start();
  }

  std::mt19937 random_;
  double share_ = 0.0;
  int maps_ = 0;
  std::vector<Objects> late_objects_;
  std::vector<MapNear> late_nears_;
};

TEST_F(NearWithFaults, LostDoubledAndReorderedStatesLeadToTheSameIdsOnAStreet) {
  onAStreet(100.0);
  const auto calm = idsAfter(400.0, 0, 0.0);
  ASSERT_GE(calm.size(), 12u);
  for (const auto& [thing, ids] : calm) EXPECT_THAT(ids, ElementsAre(thing + 1));
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    EXPECT_EQ(idsAfter(400.0, seed, 0.25), calm) << "seed " << seed;
  }
}

TEST_F(NearWithFaults, LostDoubledAndReorderedStatesLeadToTheSameIdsAfterALoop) {
  const auto calm = idsAfter(1.4 * kLap_m, 0, 0.0);
  ASSERT_GE(loops(), 1u);
  for (const auto& [thing, ids] : calm) EXPECT_EQ(ids.size(), 1u) << thing;
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    EXPECT_EQ(idsAfter(1.4 * kLap_m, seed, 0.2), calm) << "seed " << seed;
  }
}

/// The store or the filter is killed between two messages and restarts at once.
class NearWithKills : public NearWithFaults {
 protected:
  enum class Side { kStore, kFilter };

  void stepWith(int kill_at, Side side) {
    const auto mayDie = [&](int message) {
      if (message != kill_at) return;
      side == Side::kStore ? restartStore() : restartFilter();
    };
    mayDie(0);
    hear();
    mayDie(1);
    move();
    mayDie(2);
    see();
    const Objects now = objects();
    node_->onObjects(now);
    mayDie(3);
    node_->tick(now.stamp.time.time_since_epoch());
    mayDie(4);
  }
  static constexpr int kMessages = 5;
};

TEST_F(NearWithKills, BetweenAnyTwoMessagesOnAStreetLeaveTheIds) {
  onAStreet(100.0);
  const auto calm = idsAfter(250.0, 0, 0.0);
  for (const auto& [thing, ids] : calm) EXPECT_THAT(ids, ElementsAre(thing + 1));
  for (const Side side : {Side::kStore, Side::kFilter}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      beginWith(seed, 0.0);
      std::uniform_int_distribution<int> message(0, 20 * kMessages - 1);
      while (way_m_ < 250.0) stepWith(message(random_), side);
      EXPECT_EQ(idsInTheEnd(), calm) << "seed " << seed;
    }
  }
}

TEST_F(NearWithKills, BetweenAnyTwoMessagesAroundALoopLeaveTheIds) {
  const double end_m = 1.25 * kLap_m;
  const auto calm = idsAfter(end_m, 0, 0.0);
  for (const auto& [thing, ids] : calm) EXPECT_EQ(ids.size(), 1u) << thing;
  beginWith(0, 0.0);
  driveToTheLoop();
  const double loop_m = way_m_;
  for (const Side side : {Side::kStore, Side::kFilter}) {
    for (int message = 0; message < kMessages + 2; ++message) {
      beginWith(0, 0.0);
      driveTo(loop_m - 1.0);
      stepWith(message, side);
      stepWith(message - kMessages, side);
      driveTo(end_m);
      EXPECT_EQ(idsInTheEnd(), calm)
          << (side == Side::kStore ? "store" : "filter") << ", message " << message;
    }
  }
}

}  // namespace
}  // namespace perdure::map_store

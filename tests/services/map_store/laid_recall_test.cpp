// What the map store lays beside the body where its graph has closed a loop, and what it keeps of
// that in the file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/so3.h"
#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::IsEmpty;

constexpr double kSide_m = 60.0, kLap_m = 4.0 * kSide_m, kReach_m = 25.0;
constexpr double kDrift = 2e-4;  ///< of yaw, rad/m
const WorldId kHere{77, 1};

RigidTransform planar(double x, double y, double yaw) {
  return {rotationAboutZ(yaw), Eigen::Vector3d(x, y, 0.0)};
}

/// Where the body is after `way_m` of laps around a block, anticlockwise.
RigidTransform onLap(double way_m) {
  const double s = std::fmod(way_m, kLap_m);
  const int side = static_cast<int>(s / kSide_m);
  RigidTransform corner;
  for (int i = 0; i < side; ++i) corner = corner * planar(kSide_m, 0.0, 0.5 * std::numbers::pi);
  return corner * planar(s - side * kSide_m, 0.0, 0.0);
}

struct Thing {
  Eigen::Vector3d p;
  const char* name;
};

/// At gaps that no other place has.
std::vector<Thing> things() {
  const char* names[] = {"car", "person", "car", "van", "car", "car", "person"};
  std::vector<Thing> result;
  double s = 2.0;
  for (std::size_t i = 0; s < kLap_m; s += 4.0 + 0.9 * static_cast<double>((5 * i * i) % 7), ++i) {
    const double side = i % 3 == 1 ? -1.0 : 1.0;
    result.push_back(
        {onLap(s) * Eigen::Vector3d(0.0, side * (4.0 + 0.5 * static_cast<double>(i % 5)), 0.8),
         names[(i * i + i / 3) % 7]});
  }
  return result;
}

/// A drive around the block with a map store that keeps a graph, and a filter that gives all that
/// it sees anew a new id until it is told better.
class LaidRecall : public ::testing::Test {
 protected:
  LaidRecall() {
    config_.store_path = folder_.file("map.sqlite");
    config_.graph = true;
    config_.mapping.anchor.walk_yaw = 0.003;
  }

  void start() {
    node_ = std::make_unique<Node>(
        config_, 5,
        Outputs{[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
                [this](const MapReply& r) { replies_.push_back(r); },
                [this](const Recalled& r) { recalled_.push_back(r); }});
  }

  void driveTo(double way_m) {
    while (way_m_ < way_m) step();
  }
  /// Returns what was sent when the first loop was closed.
  Recalled driveToTheLoop() {
    while (recalled_.empty() && way_m_ < 1.5 * kLap_m) step();
    return recalled_.empty() ? Recalled{} : recalled_.front();
  }

  void step() {
    way_m_ += 1.0;
    T_WB_ = T_WB_ * (onLap(way_m_ - 1.0).inverse() * onLap(way_m_)) * planar(0.0, 0.0, kDrift);
    Odometry odometry;
    odometry.stamp = stamp(++sequence_);
    odometry.world = kHere;
    odometry.state = OdometryState::kTracking;
    odometry.T_WB = T_WB_;
    node_->onOdometry(odometry);
    const RigidTransform T_BM = onLap(way_m_).inverse();
    for (std::size_t i = 0; i < things_.size(); ++i) {
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      if (p_B.x() > 2.0 && p_B.norm() < kReach_m) {
        if (!in_sight_.contains(i)) in_sight_[i] = next_id_++;
        const ObjectId id = in_sight_.at(i);
        thing_of_[id] = i;
        working_[id] = seen(id, T_WB_ * p_B, things_[i].name);
      } else if (p_B.norm() > kReach_m + 15.0 && in_sight_.contains(i)) {
        working_.erase(in_sight_.at(i));
        in_sight_.erase(i);
      }
    }
    publish();
  }

  ObjectBelief seen(ObjectId id, const Eigen::Vector3d& p_W, const char* name) const {
    ObjectBelief belief = carAt(id, p_W, name);
    belief.last_seen = belief.as_of = stamp(sequence_).time;
    for (ClassBelief& c : belief.classes) {
      c.mean[3] = 0.3 + yawOf(T_WB_.R()) - yawOf(onLap(way_m_).R());
      c.covariance = 0.03 * Matrix7d::Identity();
      c.cross_pose.setZero();
    }
    return belief;
  }

  void publish() {
    std::vector<ObjectBelief> beliefs;
    for (const auto& [id, belief] : working_) beliefs.push_back(belief);
    Objects objects = workingSet(sequence_, std::move(beliefs));
    objects.stamp = stamp(sequence_);
    objects.T_WB = T_WB_;
    objects.next_id = next_id_;
    node_->onObjects(objects);
    node_->tick(objects.stamp.time.time_since_epoch());
  }

  static FrameStamp stamp(std::uint64_t sequence) {
    return {42, sequence, fromNanoseconds(100'000'000 * static_cast<std::int64_t>(sequence)), 0};
  }

  /// As a filter takes it up: not seen yet.
  void takeUp(const ObjectBelief& belief) {
    working_[belief.id] = belief;
    working_[belief.id].recalled = true;
  }

  ObjectBelief stored(ObjectId id) {
    node_->flush();
    MapQuery query;
    query.client = 3;
    query.request = ++request_;
    query.kind = MapQueryKind::kById;
    query.object_id = id;
    query.limit = 1;
    node_->onQuery(query);
    EXPECT_EQ(replies_.back().beliefs.size(), 1u) << id;
    return replies_.back().beliefs.empty() ? ObjectBelief{} : replies_.back().beliefs.front();
  }

  void ask(const Eigen::Vector3d& centre, double radius_m) {
    recalled_.clear();
    MapQuery query;
    query.client = 11;
    query.request = ++request_;
    query.kind = MapQueryKind::kRecall;
    query.low = centre;
    query.radius = radius_m;
    query.world = kHere;
    query.limit = 100;
    node_->onQuery(query);
  }
  static bool has(const Recalled& recalled, ObjectId id) {
    return std::any_of(recalled.objects.begin(), recalled.objects.end(),
                       [&](const ObjectBelief& o) { return o.id == id; });
  }

  /// One of what was laid that the body does not see now.
  const ObjectBelief* unseenOf(const Recalled& laid) const {
    for (const ObjectBelief& belief : laid.objects) {
      if (!in_sight_.contains(thing_of_.at(belief.id))) return &belief;
    }
    return nullptr;
  }

  TemporaryFolder folder_;
  Config config_;
  std::unique_ptr<Node> node_;
  std::vector<MapReply> replies_;
  std::vector<Recalled> recalled_;
  std::vector<Thing> things_ = things();
  std::map<std::size_t, ObjectId> in_sight_;
  std::map<ObjectId, std::size_t> thing_of_;
  std::map<ObjectId, ObjectBelief> working_;
  RigidTransform T_WB_;
  double way_m_ = 0.0;
  std::uint64_t sequence_ = 0, request_ = 0;
  ObjectId next_id_ = 1;
};

TEST_F(LaidRecall, ALoopLaysTheFirstLapBesideTheBodyAndJoinsWhatIsOne) {
  start();
  driveTo(kLap_m - 40.0);
  ASSERT_THAT(recalled_, IsEmpty());
  const Recalled laid = driveToTheLoop();
  ASSERT_TRUE(laid.laid);
  EXPECT_TRUE(laid.graph);
  EXPECT_FALSE(laid.restore);
  EXPECT_EQ(laid.client, 11u);
  EXPECT_EQ(laid.world, kHere);
  EXPECT_EQ(laid.next_id, next_id_);
  const RigidTransform T_BM = onLap(way_m_).inverse();
  ASSERT_GT((T_WB_.p - onLap(way_m_).p).norm(), 1.0) << "a drift that shows";

  ASSERT_FALSE(laid.merges.empty());
  for (const MergeOrder& merge : laid.merges) {
    EXPECT_EQ(merge.loop, laid.merges.front().loop);
    EXPECT_LT(merge.survivor, merge.absorbed);
    EXPECT_EQ(thing_of_.at(merge.survivor), thing_of_.at(merge.absorbed));
    EXPECT_TRUE(working_.contains(merge.absorbed));
    EXPECT_TRUE(has(laid, merge.survivor)) << "what is to survive comes with it";
  }
  ASSERT_GE(laid.objects.size(), 4u);
  std::set<ObjectId> ids;
  for (const ObjectBelief& belief : laid.objects) {
    EXPECT_TRUE(ids.insert(belief.id).second) << belief.id << " twice";
    EXPECT_FALSE(working_.contains(belief.id));
    const ClassBelief& best = belief.best();
    const Eigen::Vector3d laid_B = T_WB_.inverse() * Eigen::Vector3d(best.mean.head<3>());
    const Eigen::Vector3d p_B = T_BM * things_[thing_of_.at(belief.id)].p;
    EXPECT_LT((laid_B - p_B).norm(), 1.5) << belief.id;
    EXPECT_EQ(best.name, things_[thing_of_.at(belief.id)].name);
    EXPECT_TRUE(best.cross_pose.isZero());
    EXPECT_GT(best.covariance(0, 0), 0.03) << "with the error of the graph";
    EXPECT_LT(best.covariance(0, 0), 3.0);
  }
}

TEST_F(LaidRecall, WhereItLaidAnUnseenObjectIsNotWrittenOverWhatWasSeen) {
  start();
  const Recalled laid = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(laid);
  ASSERT_NE(unseen, nullptr);
  const ObjectId id = unseen->id;
  const auto before = encodeBelief(stored(id));
  takeUp(*unseen);
  ++sequence_;
  publish();
  EXPECT_EQ(encodeBelief(stored(id)), before) << "in the working set";
  working_.erase(id);
  ++sequence_;
  publish();
  EXPECT_EQ(encodeBelief(stored(id)), before) << "and after it left unseen";

  takeUp(*unseen);
  ++sequence_;
  publish();
  working_[id] = seen(id, unseen->best().mean.head<3>(), "car");
  ++sequence_;
  publish();
  EXPECT_EQ(stored(id).last_seen, stamp(sequence_ - 1).time) << "seen again, it is written";
  EXPECT_NE(encodeBelief(stored(id)), before);
}

TEST_F(LaidRecall, WhatLeftUnseenIsLaidAgainWhenItIsAskedFor) {
  start();
  const Recalled laid = driveToTheLoop();
  const ObjectBelief* unseen = unseenOf(laid);
  ASSERT_NE(unseen, nullptr);
  const ObjectBelief there = *unseen;
  takeUp(there);
  ++sequence_;
  publish();
  ask(there.best().mean.head<3>(), 20.0);
  for (const Recalled& answer : recalled_) EXPECT_FALSE(has(answer, there.id)) << "it is there";
  working_.erase(there.id);
  ++sequence_;
  publish();
  ask(there.best().mean.head<3>(), 20.0);
  ASSERT_EQ(recalled_.size(), 2u);
  EXPECT_FALSE(recalled_[0].laid);
  EXPECT_TRUE(recalled_[0].graph);
  EXPECT_FALSE(has(recalled_[0], there.id)) << "where it was, is no longer true";
  EXPECT_TRUE(recalled_[1].laid);
  EXPECT_TRUE(has(recalled_[1], there.id));
}

TEST_F(LaidRecall, WhatThisLapLeftBehindIsRecalledAsItWasStored) {
  start();
  driveTo(70.0);
  const ObjectId left = 1;
  ASSERT_FALSE(working_.contains(left));
  const ObjectBelief as_stored = stored(left);
  ask(as_stored.best().mean.head<3>(), 5.0);
  ASSERT_FALSE(recalled_.empty());
  EXPECT_FALSE(recalled_.front().laid);
  ASSERT_TRUE(has(recalled_.front(), left));
  EXPECT_EQ(recalled_.front().objects.front().best().mean, as_stored.best().mean);
}

TEST_F(LaidRecall, TheGraphOutlivesTheProcess) {
  start();
  driveTo(70.0);
  const ObjectBelief as_stored = stored(1);
  node_.reset();
  start();
  step();
  EXPECT_TRUE(node_->mapper().holds(1));
  EXPECT_GT(node_->mapper().anchors().size(), 5u);
  ask(as_stored.best().mean.head<3>(), 5.0);
  ASSERT_EQ(recalled_.size(), 1u);
  EXPECT_FALSE(recalled_.front().laid);
  EXPECT_TRUE(recalled_.front().graph);
  ASSERT_TRUE(has(recalled_.front(), 1));
  EXPECT_EQ(recalled_.front().objects.front().best().mean, as_stored.best().mean);
  EXPECT_EQ(recalled_.front().objects.front().best().covariance, as_stored.best().covariance);
}

TEST_F(LaidRecall, WithoutAGraphNothingIsLaid) {
  config_.graph = false;
  start();
  driveTo(1.3 * kLap_m);
  EXPECT_THAT(recalled_, IsEmpty());
  ask(T_WB_.p, 40.0);
  ASSERT_EQ(recalled_.size(), 1u);
  EXPECT_FALSE(recalled_.front().laid);
  EXPECT_FALSE(recalled_.front().graph);
}

TEST_F(LaidRecall, WhatIsGoneIsNotLaid) {
  start();
  driveTo(kLap_m - 40.0);
  Event gone;
  gone.kind = EventKind::kGone;
  gone.world = kHere;
  gone.stamp = stamp(sequence_);
  gone.object_id = 2;
  node_->onEvent(gone);
  const Recalled laid = driveToTheLoop();
  ASSERT_TRUE(laid.laid);
  EXPECT_FALSE(has(laid, 2));
  for (const MergeOrder& merge : laid.merges) EXPECT_NE(merge.survivor, 2u);
}

}  // namespace
}  // namespace perdure::map_store

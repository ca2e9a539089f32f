// The map along a drive: twice around a block with odometry that drifts.
#include "common/mapping/mapper.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSide_m = 150.0, kLap_m = 4.0 * kSide_m;
constexpr double kReach_m = 30.0;
const WorldId kWorld{7, 1};

/// An object beside the way, as it is.
struct Thing {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double yaw = 0.0;
  std::string name;
};

/// Where the body is after `way_m` of laps, anticlockwise.
LevelPose onLap(double way_m) {
  const double s = std::fmod(way_m, kLap_m);
  const double side = std::floor(s / kSide_m), along = s - side * kSide_m;
  LevelPose corner;
  for (int i = 0; i < static_cast<int>(side); ++i) {
    corner = corner * LevelPose{{kSide_m, 0.0, 0.0}, 0.5 * kPi};
  }
  return corner * LevelPose{{along, 0.0, 0.0}, 0.0};
}

std::vector<Thing> thingsAlong(std::mt19937& random) {
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<Thing> things;
  for (double s = 3.0; s < kLap_m; s += 5.0 + 8.0 * any(random)) {
    const bool car = any(random) < 0.6;
    const double side = any(random) < 0.5 ? -1.0 : 1.0;
    const LevelPose at = onLap(s);
    Thing thing;
    thing.p = at * Eigen::Vector3d(0.0, side * (car ? 4.0 : 5.0 + 3.0 * any(random)), 0.8);
    thing.yaw = car ? at.yaw : kPi * any(random);
    thing.name = car ? "car" : any(random) < 0.5 ? "person" : "van";
    things.push_back(thing);
  }
  return things;
}

struct Settings {
  std::uint32_t seed = 1;
  double yaw_walk = 0.0;       ///< true, rad/√m
  double told_yaw_walk = 0.0;  ///< 0: the same
  double way_m = 1.4 * kLap_m;
};

/// Drives, and does what the filter would: keeps objects in sight, gives new ones ids, takes the
/// ids of those that the mapper lays where it sees them, and joins what it is told to join.
class Drive {
 public:
  explicit Drive(const Settings& settings)
      : settings_(settings),
        random_(settings.seed),
        things_(thingsAlong(random_)),
        mapper_(parametersOf(settings)) {
    in_sight_.resize(things_.size());
  }

  static Parameters parametersOf(const Settings& settings) {
    Parameters parameters;
    const double told = settings.told_yaw_walk > 0.0 ? settings.told_yaw_walk : settings.yaw_walk;
    if (told > 0.0) parameters.anchor.walk_yaw = told;
    return parameters;
  }

  void to(double way_m) {
    while (way_m_ < way_m) step();
  }
  void toTheEnd() { to(settings_.way_m); }
  void toTheFirstLoop() {
    while (loops_.empty() && way_m_ < settings_.way_m) step();
  }

  LevelPose truth() const { return onLap(way_m_); }
  const LevelPose& odometry() const { return T_WB_; }
  double way_m() const { return way_m_; }
  Mapper& mapper() { return mapper_; }
  const std::vector<LoopClosure>& loops() const { return loops_; }
  /// How far the body was off in M before the message that closed the first loop, and after.
  double offBefore() const { return off_before_; }
  double offAfter() const { return off_after_; }
  double off() const { return (mapper_.T_MW() * T_WB_.p - truth().p).norm(); }
  /// Which thing an id was given to.
  const std::map<ObjectId, std::size_t>& things() const { return thing_of_; }
  const Thing& thing(ObjectId id) const { return things_[thing_of_.at(id)]; }
  /// Merge orders that joined two objects that are one, and that are two.
  std::size_t right() const { return right_; }
  std::size_t wrong() const { return wrong_; }
  /// Objects of the first lap that came again under their own ids.
  std::size_t recalled() const { return recalled_; }
  std::size_t renamed() const { return renamed_; }
  /// What was last believed of an object, in W.
  const ObjectBelief& stored(ObjectId id) const { return stored_.at(id); }

 private:
  struct Sight {
    ObjectId id = 0;  ///< 0: not in the working set
    Eigen::Vector4d error = Eigen::Vector4d::Zero();
    TimePoint first, last;
    std::uint32_t hits = 0;
    double last_way_m = 0.0;
  };

  double normal(double deviation) {
    return deviation * std::normal_distribution<double>()(random_);
  }

  void step() {
    constexpr double kStep_m = 1.0;
    const LevelPose before = truth();
    way_m_ += kStep_m;
    LevelPose increment = before.inverse() * truth();
    increment.yaw += normal(settings_.yaw_walk);
    T_WB_ = T_WB_ * increment;
    ++sequence_;
    mapper_.onOdometry(odometryMessage());
    const double off_before = off();
    mapper_.onObjects(objectsMessage());
    const MapChange change = mapper_.takeChange();
    if (loops_.empty() && !change.loops.empty()) {
      off_before_ = off_before;
      off_after_ = off();
    }
    loops_.insert(loops_.end(), change.loops.begin(), change.loops.end());
    for (const MergeOrder& merge : change.merges) join(merge);
  }

  FrameStamp stamp() const {
    return {1, sequence_, TimePoint(durationFromSeconds(0.1 * static_cast<double>(sequence_))), 0};
  }

  Odometry odometryMessage() const {
    Odometry o;
    o.stamp = stamp();
    o.world = kWorld;
    o.state = OdometryState::kTracking;
    o.T_WB = T_WB_.rigid();
    return o;
  }

  static Eigen::Vector4d deviations() { return {0.15, 0.15, 0.08, 0.12}; }

  Objects objectsMessage() {
    Objects objects;
    objects.stamp = stamp();
    objects.world = kWorld;
    objects.T_WB = T_WB_.rigid();
    const LevelPose T_BM = truth().inverse();
    std::map<ObjectId, Recallable> offered;
    for (const Recallable& there : mapper_.near(T_WB_.p, 60.0)) offered[there.id] = there;
    for (std::size_t i = 0; i < things_.size(); ++i) {
      Sight& sight = in_sight_[i];
      const Eigen::Vector3d p_B = T_BM * things_[i].p;
      const bool seen = p_B.x() > 2.0 && p_B.norm() < kReach_m;
      if (seen) {
        if (sight.id == 0) begin(i, p_B, offered);
        sight.last = stamp().time;
        sight.last_way_m = way_m_;
        ++sight.hits;
        stored_[sight.id] = beliefOf(i, p_B);
      } else if (sight.id != 0 && way_m_ - sight.last_way_m > 40.0) {
        sight = {};
      }
      if (sight.id != 0) objects.objects.push_back(stored_.at(sight.id));
    }
    objects.next_id = next_id_;
    return objects;
  }

  void begin(std::size_t i, const Eigen::Vector3d& p_B,
             const std::map<ObjectId, Recallable>& offered) {
    Sight& sight = in_sight_[i];
    sight = {};
    for (double& e : sight.error) e = normal(1.0);
    sight.error = (sight.error.array() * deviations().array()).matrix().eval();
    sight.first = stamp().time;
    double nearest_m = 2.5;
    for (const auto& [id, there] : offered) {
      if (!stored_.contains(id) || stored_.at(id).best().name != things_[i].name) continue;
      const Eigen::Vector3d stored = stored_.at(id).best().mean.head<3>();
      const Eigen::Vector3d laid = there.T_now ? *there.T_now * stored : stored;
      const double apart_m = (laid - T_WB_ * p_B).head<2>().norm();
      if (apart_m > nearest_m) continue;
      nearest_m = apart_m;
      sight.id = id;
    }
    const bool again = std::any_of(thing_of_.begin(), thing_of_.end(),
                                   [&](const auto& known) { return known.second == i; });
    if (sight.id == 0) {
      sight.id = next_id_++;
      if (again) ++renamed_;
    } else if (thing_of_.at(sight.id) == i) {
      ++recalled_;
    } else {
      ++wrong_;
    }
    thing_of_[sight.id] = i;
  }

  ObjectBelief beliefOf(std::size_t i, const Eigen::Vector3d& p_B) const {
    const Sight& sight = in_sight_[i];
    ObjectBelief belief;
    belief.id = sight.id;
    belief.existence = 0.95;
    belief.confirmed = sight.hits >= 3;
    belief.hits = sight.hits;
    belief.first_seen = sight.first;
    belief.last_seen = belief.as_of = sight.last;
    ClassBelief c;
    c.name = things_[i].name;
    c.probability = 0.9;
    c.mean.head<3>() = T_WB_ * (p_B + sight.error.head<3>());
    c.mean[3] = wrapAngle(things_[i].yaw - truth().yaw + T_WB_.yaw + sight.error[3]);
    c.covariance = 0.01 * Matrix7d::Identity();
    c.covariance.topLeftCorner<4, 4>() = deviations().array().square().matrix().asDiagonal();
    ClassBelief other = c;
    other.name = kOtherClass;
    other.probability = 0.1;
    belief.classes = {c, other};
    return belief;
  }

  void join(const MergeOrder& merge) {
    const auto survivor = thing_of_.find(merge.survivor), absorbed = thing_of_.find(merge.absorbed);
    ASSERT_TRUE(survivor != thing_of_.end() && absorbed != thing_of_.end());
    EXPECT_LT(merge.survivor, merge.absorbed);
    ++(survivor->second == absorbed->second ? right_ : wrong_);
    for (Sight& sight : in_sight_) {
      if (sight.id != merge.absorbed) continue;
      sight.id = merge.survivor;
      ObjectBelief belief = stored_.at(merge.absorbed);
      belief.id = merge.survivor;
      stored_[merge.survivor] = belief;
    }
    mapper_.onMerged(merge.survivor, merge.absorbed);
  }

  Settings settings_;
  std::mt19937 random_;
  std::vector<Thing> things_;
  Mapper mapper_;
  std::vector<Sight> in_sight_;
  std::map<ObjectId, std::size_t> thing_of_;
  std::map<ObjectId, ObjectBelief> stored_;
  LevelPose T_WB_;
  double way_m_ = 0.0, off_before_ = 0.0, off_after_ = 0.0;
  std::uint64_t sequence_ = 0;
  ObjectId next_id_ = 1;
  std::vector<LoopClosure> loops_;
  std::size_t right_ = 0, wrong_ = 0, recalled_ = 0, renamed_ = 0;
};

constexpr Settings kDrifting{.seed = 4, .yaw_walk = 0.002};

TEST(Mapper, ClosesTheLoopOfASecondLap) {
  std::size_t right = 0;
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive drive({.seed = seed, .yaw_walk = 0.002});
    drive.toTheEnd();
    ASSERT_FALSE(drive.loops().empty()) << seed;
    EXPECT_EQ(drive.wrong(), 0u) << seed;
    // As far as it was off, it was corrected.
    EXPECT_NEAR(drive.loops().front().correction_m, drive.offBefore(),
                0.3 + 0.15 * drive.offBefore())
        << seed;
    EXPECT_LT(drive.offAfter(), 0.8) << seed << ", before: " << drive.offBefore();
    EXPECT_LT(drive.off(), 3.0) << seed << ": what is seen under its old id closes no loop";
    // What came after the loop came under the ids of the first lap.
    EXPECT_GT(drive.recalled(), drive.renamed()) << seed;
    right += drive.right();
  }
  EXPECT_GT(right, 3u);
}

TEST(Mapper, CorrectsTheWayBehindAsWell) {
  Drive drive(kDrifting);
  drive.toTheEnd();
  ASSERT_FALSE(drive.loops().empty());
  ASSERT_GT(drive.offBefore(), 2.0) << "a drift that shows";
  double before = 0.0, after = 0.0;
  std::size_t count = 0;
  for (const auto& [id, anchor] : drive.mapper().anchors()) {
    const LevelPose truth = onLap(anchor.way_m);
    before += (anchor.T_WA.p - truth.p).squaredNorm();
    after += (drive.mapper().graph().pose(id).p - truth.p).squaredNorm();
    ++count;
  }
  EXPECT_LT(after, 0.25 * before) << std::sqrt(before / static_cast<double>(count)) << " m before, "
                                  << std::sqrt(after / static_cast<double>(count)) << " m after";
  const auto along = drive.mapper().along(kWorld);
  EXPECT_EQ(along.size(), drive.mapper().anchors().size());
  EXPECT_TRUE(drive.mapper().along({8, 1}).empty());
}

TEST(Mapper, HoldsTheFirstLapBackUntilItsPlaceIsKnown) {
  Drive drive({.seed = 4, .yaw_walk = 0.002, .told_yaw_walk = 0.004});
  drive.to(kLap_m - 40.0);  // it does not see the beginning yet
  const double last_of_before_m = 250.0;
  const auto early = [&] {
    std::vector<Recallable> result;
    for (const Recallable& there : drive.mapper().near(drive.odometry().p, 40.0)) {
      const double way_m = 10.0 * toSeconds(drive.stored(there.id).last_seen);
      if (way_m < last_of_before_m) result.push_back(there);
    }
    return result;
  };
  while (drive.loops().empty() && drive.way_m() < 1.3 * kLap_m) {
    EXPECT_TRUE(early().empty()) << drive.way_m();
    drive.to(drive.way_m() + 1.0);
  }
  ASSERT_FALSE(drive.loops().empty());
  const auto there = early();
  ASSERT_GE(there.size(), 1u);
  for (const Recallable& r : there) {
    ASSERT_TRUE(r.T_now) << r.id;
    const Eigen::Vector3d laid_B =
        drive.odometry().inverse() *
        (*r.T_now * Eigen::Vector3d(drive.stored(r.id).best().mean.head<3>()));
    const Eigen::Vector3d p_B = drive.truth().inverse() * drive.thing(r.id).p;
    EXPECT_LT((laid_B - p_B).head<2>().norm(), 2.0) << r.id;
    EXPECT_LT(r.covariance.diagonal().head<2>().maxCoeff(), 1.0 + 1e-9);
    EXPECT_GT(r.covariance(0, 0), 0.0);
  }
}

TEST(Mapper, WhatWasSeenOfLateLiesWhereTheOdometryHasIt) {
  Drive drive(kDrifting);
  drive.to(100.0);
  std::size_t of_late = 0;
  for (const Recallable& there : drive.mapper().near(drive.odometry().p, 30.0)) {
    EXPECT_FALSE(there.T_now) << there.id;
    ++of_late;
  }
  EXPECT_GE(of_late, 3u);
}

TEST(Mapper, AnObjectThatIsGoneIsNotRecalled) {
  Drive drive(kDrifting);
  drive.toTheFirstLoop();
  ASSERT_FALSE(drive.loops().empty());
  const auto before = drive.mapper().near(drive.odometry().p, 40.0);
  ASSERT_FALSE(before.empty());
  const ObjectId gone = before.front().id;
  EXPECT_TRUE(drive.mapper().holds(gone));
  drive.mapper().onGone(gone);
  EXPECT_FALSE(drive.mapper().holds(gone));
  const auto after = drive.mapper().near(drive.odometry().p, 40.0);
  EXPECT_EQ(after.size() + 1, before.size());
  for (const Recallable& there : after) EXPECT_NE(there.id, gone);
  // Nor is it taken for one that is seen from then on.
  const std::size_t wrong = drive.wrong();
  drive.to(drive.way_m() + 60.0);
  EXPECT_EQ(drive.wrong(), wrong);
}

TEST(Mapper, NothingOfAMergeIsLeftUnderTheYoungerId) {
  Drive drive(kDrifting);
  drive.toTheEnd();
  ASSERT_GT(drive.right(), 0u);
  std::map<std::size_t, ObjectId> by_thing;
  std::size_t twice = 0;
  for (const auto& [id, thing] : drive.things()) {
    if (drive.mapper().holds(id) && !by_thing.emplace(thing, id).second) ++twice;
  }
  EXPECT_LE(twice + drive.right(), drive.renamed());
}

TEST(Mapper, WhatIsJoinedWithAYoungOneStaysOnTheMap) {
  Drive drive(kDrifting);
  drive.to(40.0);
  const ObjectId known = drive.things().begin()->first;
  ASSERT_TRUE(drive.mapper().holds(known));
  Objects objects;
  objects.world = kWorld;
  objects.objects = {drive.stored(known)};
  ObjectBelief& young = objects.objects.front();
  young.id = 1000;
  young.confirmed = false;
  young.last_seen += durationFromSeconds(60.0);
  drive.mapper().onObjects(objects);
  EXPECT_FALSE(drive.mapper().holds(1000));
  drive.mapper().onMerged(known, 1000);
  EXPECT_TRUE(drive.mapper().holds(known));
  EXPECT_FALSE(drive.mapper().holds(1000));
}

TEST(Mapper, TheSameMessagesGiveTheSameMap) {
  Drive one(kDrifting), two(kDrifting);
  one.toTheEnd();
  two.toTheEnd();
  ASSERT_EQ(one.loops().size(), two.loops().size());
  for (const auto& [id, pose] : one.mapper().graph().poses()) {
    EXPECT_EQ(pose.p, two.mapper().graph().pose(id).p) << id;
    EXPECT_EQ(pose.yaw, two.mapper().graph().pose(id).yaw) << id;
  }
}

TEST(Mapper, WithoutDriftNothingMoves) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Drive drive({.seed = seed});
    drive.to(2.0 * kLap_m);
    EXPECT_EQ(drive.wrong(), 0u);
    for (const auto& [id, anchor] : drive.mapper().anchors()) {
      EXPECT_LT((drive.mapper().graph().pose(id).p - anchor.T_WA.p).norm(), 0.5)
          << seed << " " << id;
    }
    EXPECT_LT(drive.off(), 0.5) << seed;
  }
}

TEST(Mapper, AnotherWorldIsNotLaidBesideThis) {
  Drive drive(kDrifting);
  drive.to(100.0);
  Odometry lost;
  lost.world = {kWorld.world, kWorld.epoch + 1};
  lost.state = OdometryState::kTracking;
  drive.mapper().onOdometry(lost);
  EXPECT_TRUE(drive.mapper().near(Eigen::Vector3d::Zero(), 500.0).empty());
  EXPECT_EQ(drive.mapper().along(lost.world).size(), 1u);
  EXPECT_TRUE(drive.mapper().holds(drive.things().begin()->first)) << "it stays on the map";
}

TEST(Mapper, SaysNothingBeforeTheFirstPose) {
  Mapper mapper{{}};
  Objects objects;
  objects.objects.resize(1);
  objects.objects.front().classes.resize(1);
  mapper.onObjects(objects);
  EXPECT_TRUE(mapper.near(Eigen::Vector3d::Zero(), 100.0).empty());
  EXPECT_TRUE(mapper.takeChange().loops.empty());
  EXPECT_FALSE(mapper.holds(0));
  EXPECT_EQ(mapper.T_MW().p.norm(), 0.0);
  Odometry odometry;
  odometry.state = OdometryState::kInitialising;
  mapper.onOdometry(odometry);
  EXPECT_TRUE(mapper.anchors().empty());
}

}  // namespace
}  // namespace perdure::mapping

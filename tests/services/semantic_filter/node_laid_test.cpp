// What the map's graph has laid beside the body, in the filter that is told of it.
#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "tests/services/semantic_filter/memory_run.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace)

constexpr ObjectId kLaid = 900;

/// A car that the map knows, as its store sends it: known relative to the body.
ObjectBelief laidCar(ObjectId id, const Eigen::Vector3d& p) {
  ObjectBelief belief = map_store::test::carAt(id, p);
  belief.recalled = true;
  belief.memory = Memory::kLongTerm;
  for (ClassBelief& c : belief.classes) {
    c.mean.head<3>() = p;
    c.covariance = 0.04 * Matrix7d::Identity();
    c.cross_pose.setZero();
  }
  return belief;
}

Recalled laid(std::vector<ObjectBelief> objects, std::vector<MergeOrder> merges = {}) {
  Recalled recalled;
  recalled.instance = 5;
  recalled.world = {5, 0};
  recalled.client = 9;
  recalled.next_id = 1000;
  recalled.laid = true;
  recalled.objects = std::move(objects);
  recalled.merges = std::move(merges);
  return recalled;
}

const Track* trackOf(const Pair& pair, ObjectId id) {
  for (const Track& o : pair.filter.belief().tracks) {
    if (o.id == id) return &o;
  }
  return nullptr;
}

/// Where none of the street's cars is, and no camera looks.
const Eigen::Vector3d kBehind(2.0, -9.0, 0.75);

/// One of the street's cars that was confirmed.
const ObjectBelief& seenCar(const Pair& pair) {
  const auto& objects = pair.objects.back().objects;
  const auto at = std::find_if(objects.begin(), objects.end(),
                               [](const ObjectBelief& o) { return o.confirmed; });
  EXPECT_NE(at, objects.end());
  return *at;
}

TEST(NodeLaid, ALaidObjectIsAsUncertainAsTheBodyAndSharesItsError) {
  Config config = configWith(kMemory);
  config.filter.pose.walk_position = 0.03;
  config.filter.pose.walk_rotation = 0.001;
  Pair pair(config);
  pair.driveTo(14);
  const Objects now = pair.objects.back();
  const Matrix6d P = now.pose_error;
  ASSERT_GT(P.trace(), 1e-6) << "a pose with an error";
  pair.filter.onRecalled(laid({laidCar(kLaid, kBehind)}));
  const Track* track = trackOf(pair, kLaid);
  ASSERT_NE(track, nullptr);
  EXPECT_TRUE(track->life.recalled);
  EXPECT_TRUE(track->life.confirmed);
  EXPECT_EQ(pair.filter.belief().tracks.back().id, kLaid) << "in order of id";
  // By numeric differences: the object moves with the body.
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 4, 6> A;
  const Eigen::Vector3d p_B = now.T_WB.inverse() * kBehind;
  for (int k = 0; k < 6; ++k) {
    RigidTransform moved = now.T_WB;
    if (k < 3) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      moved.q = moved.q * Eigen::Quaterniond(Eigen::AngleAxisd(kStep, axis));
    } else {
      moved.p[k - 3] += kStep;
    }
    A.col(k).head<3>() = (moved * p_B - kBehind) / kStep;
    A(3, k) = wrapAngle(yawOf(moved.R()) - yawOf(now.T_WB.R())) / kStep;
  }
  for (const Hypothesis& h : track->hypotheses) {
    EXPECT_LT((h.x.head<3>() - kBehind).norm(), 1e-12);
    const Eigen::Matrix<double, 4, 6> C = h.C.topRows<4>();
    EXPECT_LT((C - A * P).norm(), 1e-4 * (A * P).norm());
    EXPECT_TRUE(h.C.bottomRows(h.C.rows() - 4).isZero());
    const Eigen::Matrix4d expected = 0.04 * Eigen::Matrix4d::Identity() + A * P * A.transpose();
    EXPECT_LT((h.P.topLeftCorner<4, 4>() - expected).norm(), 1e-4 * expected.norm());
    EXPECT_NEAR(h.P(5, 5), 0.04, 1e-12);
  }
  pair.driveTo(15);
  EXPECT_EQ(pair.count(EventKind::kRecalled), 1u);
  EXPECT_GT(pair.objects.back().next_id, 1000u - 1u);
}

TEST(NodeLaid, AJoinThatIsUndoneGoesOnUnderTheYoungerIdAndTheOlderOneIsLaidWhereItIs) {
  Pair pair;
  pair.driveTo(14);
  const ObjectBelief seen = seenCar(pair);
  const Eigen::Vector3d beside = seen.best().mean.head<3>() + Eigen::Vector3d(0.3, -0.2, 0.0);
  pair.filter.onRecalled(laid({laidCar(kLaid, beside)}, {{1, kLaid, seen.id}}));
  ASSERT_EQ(trackOf(pair, seen.id), nullptr);
  pair.driveTo(16);
  const std::size_t born = pair.count(EventKind::kBorn);
  Recalled undone = laid({laidCar(kLaid, kBehind)});
  undone.splits = {{1, kLaid, seen.id}};
  pair.filter.onRecalled(undone);
  const Track* track = trackOf(pair, seen.id);
  ASSERT_NE(track, nullptr);
  EXPECT_LT((track->best().x.head<3>() - seen.best().mean.head<3>()).norm(), 0.5);
  EXPECT_FALSE(track->life.recalled);
  ASSERT_NE(trackOf(pair, kLaid), nullptr);
  EXPECT_LT((trackOf(pair, kLaid)->best().x.head<3>() - kBehind).norm(), 1e-9);
  pair.driveTo(18);
  EXPECT_NE(trackOf(pair, seen.id), nullptr) << "also after late detections";
  EXPECT_EQ(pair.count(EventKind::kBorn), born) << "it is no new object";
  pair.filter.onRecalled(undone);
  EXPECT_NE(trackOf(pair, seen.id), nullptr) << "an order that comes twice changes nothing";
}

TEST(NodeLaid, WhatIsOneWithIsJoinedUnderTheOlderId) {
  Pair pair;
  pair.driveTo(14);
  const ObjectBelief seen = seenCar(pair);
  const std::size_t before = pair.confirmed().size();
  const Eigen::Vector3d beside = seen.best().mean.head<3>() + Eigen::Vector3d(0.3, -0.2, 0.0);
  pair.filter.onRecalled(laid({laidCar(kLaid, beside)}, {{1, kLaid, seen.id}}));
  EXPECT_EQ(trackOf(pair, seen.id), nullptr);
  const Track* track = trackOf(pair, kLaid);
  ASSERT_NE(track, nullptr);
  EXPECT_FALSE(track->life.recalled) << "it was seen, under the other id";
  EXPECT_LT(track->best().P(0, 0) + track->best().P(1, 1), 0.2);
  pair.driveTo(16);
  const auto now = pair.confirmed();
  EXPECT_TRUE(now.contains(kLaid));
  EXPECT_FALSE(now.contains(seen.id));
  EXPECT_EQ(now.size(), before);
  std::size_t merged = 0;
  for (const Event& e : pair.events) {
    if (e.kind != EventKind::kMerged || e.object_id != kLaid) continue;
    EXPECT_EQ(e.other_id, seen.id);
    ++merged;
  }
  EXPECT_EQ(merged, 1u);
}

TEST(NodeLaid, LateDetectionsDoNotBringTheYoungerOneBack) {
  Pair pair;
  pair.driveTo(14);
  const ObjectBelief seen = seenCar(pair);
  std::deque<Detections> waiting;
  for (int i = 0; i < 3; ++i, pair.x += 0.4, ++pair.frame) {
    pair.filter.onOdometry(odometryAt(pair.frame, bodyAt(pair.x)));
    waiting.push_back(detectionsAt(pair.frame, boxesFrom(bodyAt(pair.x), pair.frame)));
    pair.talk();
  }
  pair.filter.onRecalled(laid({laidCar(kLaid, seen.best().mean.head<3>())}, {{1, kLaid, seen.id}}));
  for (const Detections& d : waiting) pair.filter.onDetections(d);
  ASSERT_GT(pair.filter.reasons().of("detections_late"), 0u);
  pair.driveTo(17);
  EXPECT_EQ(trackOf(pair, seen.id), nullptr);
  EXPECT_NE(trackOf(pair, kLaid), nullptr);
}

TEST(NodeLaid, AMergeOfWhatIsNotThereChangesNothing) {
  Pair pair;
  pair.driveTo(14);
  const auto before = pair.confirmed();
  const ObjectId seen = *before.begin();
  pair.filter.onRecalled(laid({}, {{1, 700, seen}, {1, seen, 701}, {1, 700, 701}}));
  pair.driveTo(15);
  EXPECT_EQ(pair.confirmed(), before);
  EXPECT_EQ(pair.count(EventKind::kMerged), 0u);
}

TEST(NodeLaid, WhatIsStillUnseenIsLaidAnewAndWhatWasSeenStays) {
  Pair pair;
  pair.driveTo(14);
  pair.filter.onRecalled(laid({laidCar(kLaid, kBehind)}));
  pair.driveTo(15);
  const Eigen::Vector3d better = kBehind + Eigen::Vector3d(0.8, 0.5, 0.0);
  const ObjectBelief seen = seenCar(pair);
  const State x = trackOf(pair, seen.id)->best().x;
  ASSERT_FALSE(trackOf(pair, seen.id)->life.recalled);
  const Eigen::Vector3d off = seen.best().mean.head<3>() + Eigen::Vector3d(1.5, 0.0, 0.0);
  const std::size_t count = pair.filter.belief().tracks.size();
  pair.filter.onRecalled(laid({laidCar(kLaid, better), laidCar(seen.id, off)}));
  EXPECT_EQ(pair.filter.belief().tracks.size(), count);
  EXPECT_LT((trackOf(pair, kLaid)->best().x.head<3>() - better).norm(), 1e-12);
  EXPECT_EQ(trackOf(pair, seen.id)->best().x, x);
  pair.driveTo(16);
  EXPECT_EQ(pair.count(EventKind::kRecalled), 1u) << "it came once";
  ASSERT_NE(trackOf(pair, kLaid), nullptr);
  EXPECT_LT((trackOf(pair, kLaid)->best().x.head<3>() - better).norm(), 0.2);
}

TEST(NodeLaid, WhatIsFarOrMovesIsNotTakenUp) {
  Pair pair;
  pair.driveTo(14);
  ObjectBelief moving = laidCar(kLaid, kBehind);
  moving.moving = 0.9;
  const std::size_t count = pair.filter.belief().tracks.size();
  pair.filter.onRecalled(laid({laidCar(kLaid + 1, {14.0, 300.0, 0.0}), moving}));
  EXPECT_EQ(pair.filter.belief().tracks.size(), count);
  EXPECT_EQ(pair.filter.reasons().of("recalled_moving"), 1u);
}

TEST(NodeLaid, ForAnotherFilterOrAnotherWorldNothingIsLaid) {
  Pair pair;
  pair.driveTo(14);
  const std::size_t count = pair.filter.belief().tracks.size();
  Recalled other = laid({laidCar(kLaid, kBehind)});
  other.client = 77;
  pair.filter.onRecalled(other);
  other.client = 9;
  other.world = {6, 0};
  pair.filter.onRecalled(other);
  EXPECT_EQ(pair.filter.belief().tracks.size(), count);
  EXPECT_EQ(pair.filter.reasons().of("recalled_of_other_world"), 1u);
}

}  // namespace
}  // namespace perdure::semantic_filter

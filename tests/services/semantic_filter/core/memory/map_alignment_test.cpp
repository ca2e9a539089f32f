// Map alignment: towns that are met again, other towns, rows that repeat.
#include "services/semantic_filter/core/memory/map_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;
constexpr AlignmentParameters kAlignment;

/// A grid of streets with objects beside them, as in the simulator's towns: parked cars along the
/// kerb at uneven gaps, other objects between.
class Town {
 public:
  explicit Town(std::uint32_t seed, std::size_t things = 90) : random_(seed) {
    std::uniform_real_distribution<double> along(-70.0, 70.0), any(0.0, 1.0);
    for (std::size_t i = 0; i < things; ++i) {
      const double street = 28.0 * std::floor(5.0 * any(random_) - 2.0);
      const double side = any(random_) < 0.5 ? -1.0 : 1.0, s = along(random_);
      const bool east = any(random_) < 0.5, car = any(random_) < 0.6;
      const double off = street + side * (car ? 4.0 : 6.0 + any(random_));
      PlacedThing thing;
      thing.id = i + 1;
      thing.p = east ? Eigen::Vector3d(s, off, 0.75) : Eigen::Vector3d(off, s, 0.75);
      thing.yaw = car ? (east ? 0.0 : 90.0 * kDegree_rad) : 180.0 * kDegree_rad * any(random_);
      thing.pmf = {{car                  ? "car"
                    : any(random_) < 0.5 ? "person"
                                         : "bench",
                    0.9},
                   {kOtherClass, 0.1}};
      truth_.push_back(thing);
    }
  }

  /// As a filter believes them: with errors drawn from their covariance.
  std::vector<PlacedThing> believed(const std::vector<PlacedThing>& things) {
    std::vector<PlacedThing> result;
    for (PlacedThing thing : things) {
      thing.covariance = covariance();
      const Eigen::Vector4d off = thing.covariance.llt().matrixL() * standard();
      thing.p += off.head<3>();
      thing.yaw = wrapAngle(thing.yaw + off[3] + (random_() % 2 == 0 ? std::numbers::pi : 0.0));
      result.push_back(thing);
    }
    return result;
  }

  std::vector<PlacedThing> near(const Eigen::Vector2d& spot, double reach) const {
    std::vector<PlacedThing> result;
    for (const auto& thing : truth_)
      if ((thing.p.head<2>() - spot).norm() < reach) result.push_back(thing);
    return result;
  }

  const std::vector<PlacedThing>& truth() const { return truth_; }

 private:
  Eigen::Vector4d standard() {
    std::normal_distribution<double> normal;
    return {normal(random_), normal(random_), normal(random_), normal(random_)};
  }

  /// Less certain along the line of sight than across it.
  Eigen::Matrix4d covariance() {
    std::uniform_real_distribution<double> any(0.0, 1.0);
    const Eigen::Matrix3d R = rotationAboutZ(2.0 * std::numbers::pi * any(random_));
    const Eigen::Vector3d deviation(0.2 + 0.5 * any(random_), 0.15, 0.1);
    Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
    P.topLeftCorner<3, 3>() = R * deviation.array().square().matrix().asDiagonal() * R.transpose();
    P(3, 3) = std::pow(10.0 * kDegree_rad, 2);
    return P;
  }

  std::mt19937 random_;
  std::vector<PlacedThing> truth_;
};

struct Turn {
  double yaw;
  Eigen::Vector3d p;
};

std::vector<PlacedThing> in(const Turn& W, std::vector<PlacedThing> things) {
  const Eigen::Matrix3d R = rotationAboutZ(W.yaw);
  for (PlacedThing& thing : things) {
    thing.p = R * thing.p + W.p;
    thing.yaw = wrapAngle(thing.yaw + W.yaw);
    thing.covariance.topLeftCorner<3, 3>() =
        (R * thing.covariance.topLeftCorner<3, 3>() * R.transpose()).eval();
    thing.id += 1000;
  }
  return things;
}

const Turn kTurn{130.0 * kDegree_rad, {410.0, -95.0, 1.3}};

Eigen::Vector4d errorOf(const FrameAlignment& found) {
  Eigen::Vector4d error;
  error << rotationAboutZ(kTurn.yaw) * found.about_M + kTurn.p - found * found.about_M,
      wrapAngle(kTurn.yaw - found.yaw);
  return error;
}

TEST(MapAlignment, ATownIsFoundInItsPlaceWithAnHonestCovariance) {
  std::size_t detected_on_revisit = 0;
  double squared = 0.0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Town town(seed);
    const MapAlignment map(town.believed(town.truth()), kAlignment);
    const auto found = map.align(in(kTurn, town.believed(town.near({10, -5}, 25.0))));
    if (!found) continue;
    ++detected_on_revisit;
    const Eigen::Vector4d error = errorOf(*found);
    EXPECT_LT(error.head<3>().norm(), 1.0) << seed;
    EXPECT_LT(std::abs(error[3]), 4.0 * kDegree_rad) << seed;
    squared += squaredMahalanobis(error, found->covariance) / 4.0;
    for (const auto& [remembered, seen] : found->pairs) EXPECT_EQ(remembered + 1000, seen) << seed;
  }
  EXPECT_GE(detected_on_revisit, 54u);
  const double mean = squared / static_cast<double>(detected_on_revisit);
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 1.3);
}

TEST(MapAlignment, AnotherTownOfTheSameKindIsNotTakenForIt) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Town town(seed), another(seed + 1000);
    const MapAlignment map(town.believed(town.truth()), kAlignment);
    const auto seen = in(kTurn, another.believed(another.near({10, -5}, 35.0)));
    EXPECT_FALSE(map.align(seen)) << seed;
    const auto best = map.best(seen);
    EXPECT_TRUE(!best || best->nats < kAlignment.nats) << seed << " " << best->nats;
  }
}

TEST(MapAlignment, MovedAndNewObjectsDoNotPreventIt) {
  std::size_t detected_on_revisit = 0;
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    Town town(seed), another(seed + 500);
    const MapAlignment map(town.believed(town.truth()), kAlignment);
    auto seen = town.believed(town.near({10, -5}, 35.0));
    for (std::size_t i = 0; i < seen.size(); i += 3) seen[i].p += Eigen::Vector3d(3.0, -4.0, 0.0);
    const auto guests = another.believed(another.near({10, -5}, 15.0));
    seen.insert(seen.end(), guests.begin(), guests.end());
    const auto found = map.align(in(kTurn, seen));
    if (!found) continue;
    ++detected_on_revisit;
    EXPECT_LT(errorOf(*found).head<3>().norm(), 1.0) << seed;
  }
  EXPECT_GE(detected_on_revisit, 20u);
}

TEST(MapAlignment, ARowOfEqualObjectsFitsInManyWaysUntilOneOfThemDiffers) {
  std::vector<PlacedThing> row;
  for (std::size_t i = 0; i < 20; ++i) {
    PlacedThing car;
    car.id = i + 1;
    car.p = {6.0 * static_cast<double>(i), 0.0, 0.75};
    car.covariance.diagonal() << 0.04, 0.04, 0.01, 0.02;
    car.pmf = {{"car", 0.95}, {kOtherClass, 0.05}};
    row.push_back(car);
  }
  const MapAlignment map(row, kAlignment);
  const std::vector<PlacedThing> part(row.begin() + 4, row.begin() + 14);
  EXPECT_FALSE(map.align(in(kTurn, part)));
  const auto best = map.best(in(kTurn, part));
  ASSERT_TRUE(best);
  EXPECT_GT(best->nats, kAlignment.nats) << "it fits";
  EXPECT_GT(best->next_nats, best->nats - 3.0) << "and as well elsewhere";

  for (const auto& [at, name] : {std::pair{7, "truck"}, {9, "bench"}, {12, "person"}}) {
    const auto i = static_cast<std::size_t>(at);
    row[i].pmf = {{name, 0.95}, {kOtherClass, 0.05}};
    row[i].p.y() = 2.5;
  }
  const MapAlignment odd(row, kAlignment);
  const auto found = odd.align(in(kTurn, {row.begin() + 4, row.begin() + 14}));
  ASSERT_TRUE(found);
  EXPECT_LT(errorOf(*found).norm(), 0.3);
}

TEST(MapAlignment, OfTwoSeenObjectsForOneMapObjectNeitherIsAPair) {
  Town town(2);
  const MapAlignment map(town.believed(town.truth()), kAlignment);
  auto seen = in(kTurn, town.believed(town.near({10, -5}, 35.0)));
  const auto alone = map.align(seen);
  ASSERT_TRUE(alone);
  const ObjectId twice = alone->pairs.front().second;
  const auto it =
      std::find_if(seen.begin(), seen.end(), [&](const PlacedThing& s) { return s.id == twice; });
  PlacedThing neighbour = *it;
  neighbour.id = 5000;
  seen.push_back(neighbour);
  const auto found = map.align(seen);
  ASSERT_TRUE(found);
  for (const auto& [remembered, id] : found->pairs) {
    EXPECT_NE(id, twice);
    EXPECT_NE(id, neighbour.id);
  }
}

TEST(MapAlignment, TooFewObjectsGiveNoAlignment) {
  Town town(1);
  const MapAlignment map(town.believed(town.truth()), kAlignment);
  EXPECT_FALSE(map.align({}));
  EXPECT_FALSE(map.align(in(kTurn, town.believed(town.near({10, -5}, 6.0)))));
  EXPECT_FALSE(MapAlignment({}, kAlignment).align(in(kTurn, town.believed(town.truth()))));
}

TEST(MapAlignment, ObjectsOfKnownIdentityRefineItAroundThem) {
  Town town(4);
  FrameAlignment rough;
  rough.yaw = kTurn.yaw + 2.0 * kDegree_rad;
  rough.p = kTurn.p + Eigen::Vector3d(0.4, -0.5, 0.2);
  const auto there = town.believed(town.truth()), here = in(kTurn, town.believed(town.truth()));
  std::vector<std::pair<PlacedThing, PlacedThing>> pairs;
  for (std::size_t i = 0; i < 12; ++i) pairs.emplace_back(there[i], here[i]);
  const FrameAlignment better = refined(rough, pairs);
  EXPECT_LT(errorOf(better).head<3>().norm(), 0.4);
  // 0.995 quantile of χ² with 4 degrees of freedom
  EXPECT_LT(squaredMahalanobis(errorOf(better), better.covariance), 14.9);
  pairs.resize(2);
  EXPECT_EQ(refined(rough, pairs).yaw, rough.yaw);
}

TEST(MapAlignment, ATransformedBeliefIncludesTheErrorOfTheAlignment) {
  FrameAlignment alignment;
  alignment.yaw = kTurn.yaw;
  alignment.p = kTurn.p;
  alignment.about_M = {3.0, 4.0, 0.5};
  alignment.covariance.diagonal() << 0.04, 0.09, 0.01, 0.0004;
  ObjectBelief belief;
  ClassBelief car;
  car.name = "car";
  car.mean << 23.0, -6.0, 0.75, 0.3, 1.4, 0.6, 0.4;
  car.covariance = 0.01 * Matrix7d::Identity();
  car.cross_pose.setOnes();
  belief.classes = {car};
  belief.velocity = {1.0, 0.0, 0.0};
  const ObjectBelief laid = laidInto(alignment, belief);
  const Matrix7d& P = laid.best().covariance;
  const Eigen::Vector3d p_M = car.mean.head<3>();
  EXPECT_LT((laid.best().mean.head<3>() - (rotationAboutZ(kTurn.yaw) * p_M + kTurn.p)).norm(),
            1e-12);
  EXPECT_NEAR(wrapAngle(laid.best().mean[3] - 0.3 - kTurn.yaw), 0.0, 1e-12);
  EXPECT_EQ(laid.best().mean.tail<3>(), car.mean.tail<3>());
  EXPECT_TRUE(laid.best().cross_pose.isZero());
  EXPECT_NEAR(laid.velocity.norm(), 1.0, 1e-12);

  // The same by numeric differences of the alignment about `about_M`.
  constexpr double kStep = 1e-6;
  Eigen::Matrix4d J;
  for (int k = 0; k < 4; ++k) {
    FrameAlignment moved = alignment;
    if (k < 3) moved.p[k] += kStep;
    if (k == 3) {
      moved.yaw += kStep;
      moved.p = alignment * alignment.about_M - rotationAboutZ(moved.yaw) * alignment.about_M;
    }
    const ObjectBelief other = laidInto(moved, belief);
    J.col(k) = (other.best().mean - laid.best().mean).head<4>() / kStep;
  }
  const Eigen::Matrix4d expected =
      J * alignment.covariance * J.transpose() + 0.01 * Eigen::Matrix4d::Identity();
  EXPECT_LT((P.topLeftCorner<4, 4>() - expected).norm(), 1e-6);
}

}  // namespace
}  // namespace perdure::semantic_filter

// Recognition of places by constellations: known towns, other towns, and rows that repeat.
#include "common/mapping/places/constellation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

/// The detected objects and the prior of the pose.
struct PlaceQuery {
  std::vector<PlacedObject> seen;       ///< observed objects in the body's level frame B
  std::vector<PlacedObject> map;        ///< map objects in M
  std::vector<Eigen::Vector2d> driven;  ///< positions in M from which the map's objects were
                                        ///< detected
  LevelGaussian prior;
};

std::optional<PlaceMatch> bestMatch(const PlaceQuery& query, const PlaceParameters& parameters) {
  const MapIndex index(query.map, query.driven, parameters);
  return mapping::bestMatch(query.seen, index, query.prior, parameters);
}

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr PlaceParameters kPlace;
constexpr LoopParameters kLoop;
constexpr std::uint32_t kCar = 0, kPerson = 1, kVan = 2, kOther = 3;
constexpr ObjectId kSeen = 1000;  ///< the detected object 1007 is the map's object 7

/// A grid of streets with objects beside them: parked cars along the kerb at irregular gaps, with
/// persons and vans between them.
class Town {
 public:
  explicit Town(std::uint32_t seed, std::size_t objects = 90) : random_(seed) {
    std::uniform_real_distribution<double> along(-70.0, 70.0), any(0.0, 1.0);
    for (std::size_t i = 0; i < objects; ++i) {
      const double street = 28.0 * std::floor(5.0 * any(random_) - 2.0);
      const double side = any(random_) < 0.5 ? -1.0 : 1.0, s = along(random_);
      const bool east = any(random_) < 0.5, car = any(random_) < 0.6;
      const double off = street + side * (car ? 4.0 : 6.0 + any(random_));
      PlacedObject o;
      o.id = i + 1;
      o.p = east ? Eigen::Vector3d(s, off, 0.75) : Eigen::Vector3d(off, s, 0.75);
      o.yaw = car ? (east ? 0.0 : 90.0 * kDegree) : 180.0 * kDegree * any(random_);
      o.pmf = {{car ? kCar : any(random_) < 0.5 ? kPerson : kVan, 0.9}, {kOther, 0.1}};
      truth_.push_back(o);
    }
    for (double street = -56.0; street <= 56.0; street += 28.0) {
      for (double s = -70.0; s <= 70.0; s += 12.0) {
        driven_.emplace_back(s, street);
        driven_.emplace_back(street, s);
      }
    }
  }

  /// The objects as a filter estimates them, with errors drawn from their covariances.
  std::vector<PlacedObject> believed(std::vector<PlacedObject> objects) {
    for (PlacedObject& o : objects) {
      o.covariance = covariance();
      const Eigen::Vector4d off = o.covariance.llt().matrixL() * standard();
      o.p += off.head<3>();
      o.yaw = wrapAngle(o.yaw + off[3] + (random_() % 2 == 0 ? std::numbers::pi : 0.0));
    }
    return objects;
  }

  std::vector<PlacedObject> near(const Eigen::Vector2d& spot, double reach) const {
    std::vector<PlacedObject> result;
    for (const auto& o : truth_) {
      if ((o.p.head<2>() - spot).norm() < reach) result.push_back(o);
    }
    return result;
  }

  /// A prior with an error drawn from its own covariance.
  LevelGaussian priorOf(const LevelPose& truth, double metres, double yaw) {
    LevelGaussian prior{truth, Eigen::Matrix4d::Zero()};
    prior.covariance.diagonal() << metres * metres, metres * metres, 0.25, yaw * yaw;
    const Eigen::Vector4d off = prior.covariance.llt().matrixL() * standard();
    prior.mean.p += off.head<3>();
    prior.mean.yaw = wrapAngle(prior.mean.yaw + off[3]);
    return prior;
  }

  const std::vector<PlacedObject>& truth() const { return truth_; }
  const std::vector<Eigen::Vector2d>& driven() const { return driven_; }

 private:
  Eigen::Vector4d standard() {
    std::normal_distribution<double> normal;
    Eigen::Vector4d x;
    for (double& value : x) value = normal(random_);
    return x;
  }

  /// The uncertainty is larger along the line of sight than across it.
  Eigen::Matrix4d covariance() {
    std::uniform_real_distribution<double> any(0.0, 1.0);
    const Eigen::Matrix3d R = rotationAboutZ(2.0 * std::numbers::pi * any(random_));
    const Eigen::Vector3d deviation(0.2 + 0.5 * any(random_), 0.15, 0.1);
    Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
    P.topLeftCorner<3, 3>() = R * deviation.array().square().matrix().asDiagonal() * R.transpose();
    P(3, 3) = std::pow(10.0 * kDegree, 2);
    return P;
  }

  std::mt19937 random_;
  std::vector<PlacedObject> truth_;
  std::vector<Eigen::Vector2d> driven_;
};

const LevelPose kBody{{10.0, -5.0, 1.3}, 130.0 * kDegree};  ///< T_MB

std::vector<PlacedObject> fromBody(std::vector<PlacedObject> objects,
                                   const LevelPose& T_MB = kBody) {
  for (PlacedObject& o : objects) {
    o = transformed(T_MB.inverse(), o);
    o.id += kSeen;
  }
  return objects;
}

bool isBelieved(const PlaceMatch& match) {
  return match.score - match.next >= kLoop.nats + std::log(match.cells);
}

TEST(Constellation, ATownIsFoundInItsPlaceWithAnHonestCovariance) {
  std::size_t found = 0, right = 0, wrong = 0;
  double squared = 0.0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Town town(seed);
    PlaceQuery query{fromBody(town.believed(town.near({10, -5}, 35.0))),
                     town.believed(town.truth()), town.driven(),
                     town.priorOf(kBody, 4.0, 4.0 * kDegree)};
    const auto match = bestMatch(query, kPlace);
    if (!match || !isBelieved(*match)) continue;
    ++found;
    const LevelError error = difference(kBody, match->T_MB.mean);
    EXPECT_LT(error.head<3>().norm(), 1.0) << seed;
    EXPECT_LT(std::abs(error[3]), 3.0 * kDegree) << seed;
    squared += squaredMahalanobis(error, match->T_MB.covariance) / 4.0;
    EXPECT_GE(match->pairs.size(), 4u) << seed;
    for (const auto& [known, seen] : match->pairs) ++(known + kSeen == seen ? right : wrong);
  }
  EXPECT_GE(found, 54u);
  EXPECT_LT(50 * wrong, right) << "where two stand within a metre they may be exchanged";
  const double mean = squared / static_cast<double>(found);
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 1.3);
}

TEST(Constellation, AnotherTownOfTheSameKindIsNotTakenForIt) {
  std::size_t taken = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    Town town(seed), another(seed + 1000);
    for (const double metres : {2.0, 6.0}) {
      PlaceQuery query{fromBody(another.believed(another.near({10, -5}, 35.0))),
                       town.believed(town.truth()), town.driven(),
                       town.priorOf(kBody, metres, 4.0 * kDegree)};
      const auto match = bestMatch(query, kPlace);
      if (match && isBelieved(*match)) ++taken;
    }
  }
  // One of 120 other towns has similar streets.
  EXPECT_LE(taken, 1u);
}

TEST(Constellation, MovedAndNewObjectsDoNotPreventIt) {
  std::size_t found = 0;
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    Town town(seed), another(seed + 500);
    auto seen = town.believed(town.near({10, -5}, 35.0));
    for (std::size_t i = 0; i < seen.size(); i += 3) seen[i].p += Eigen::Vector3d(3.0, -4.0, 0.0);
    for (PlacedObject& guest : another.believed(another.near({10, -5}, 15.0))) {
      guest.id += 500;
      seen.push_back(guest);
    }
    PlaceQuery query{fromBody(seen), town.believed(town.truth()), town.driven(),
                     town.priorOf(kBody, 4.0, 4.0 * kDegree)};
    const auto match = bestMatch(query, kPlace);
    if (!match || !isBelieved(*match)) continue;
    ++found;
    EXPECT_LT(difference(kBody, match->T_MB.mean).head<2>().norm(), 1.0) << seed;
  }
  EXPECT_GE(found, 20u);
}

/// Cars in one row, 6 m apart.
std::vector<PlacedObject> row() {
  std::vector<PlacedObject> cars;
  for (std::size_t i = 0; i < 20; ++i) {
    PlacedObject car;
    car.id = i + 1;
    car.p = {6.0 * static_cast<double>(i), 0.0, 0.75};
    car.covariance.diagonal() << 0.04, 0.04, 0.01, 0.02;
    car.pmf = {{kCar, 0.95}, {kOther, 0.05}};
    cars.push_back(car);
  }
  return cars;
}

PlaceQuery queryOf(const std::vector<PlacedObject>& map, const std::vector<PlacedObject>& seen,
                   double metres) {
  const LevelPose body{{50.0, 4.0, 1.0}, 10.0 * kDegree};
  PlaceQuery query{fromBody(seen, body), map, {}, {body, Eigen::Matrix4d::Zero()}};
  for (double x = 0.0; x <= 120.0; x += 12.0) query.driven.emplace_back(x, 4.0);
  query.prior.covariance.diagonal() << metres * metres, metres * metres, 0.25, 0.003;
  query.prior.mean.p.x() += 0.3;
  return query;
}

TEST(Constellation, ARowOfEqualObjectsFitsInManyWaysUntilOneOfThemDiffers) {
  auto map = row();
  const auto part = [&] { return std::vector<PlacedObject>(map.begin() + 4, map.begin() + 14); };
  const auto many = bestMatch(queryOf(map, part(), 15.0), kPlace);
  ASSERT_TRUE(many);
  EXPECT_GT(many->score, kLoop.nats) << "it fits";
  EXPECT_LT(many->score - many->next, 3.0) << "and nearly as well elsewhere";
  EXPECT_FALSE(isBelieved(*many));

  for (const auto& [at, name] : {std::pair{7u, kVan}, {9u, kPerson}, {12u, kPerson}}) {
    map[at].pmf = {{name, 0.95}, {kOther, 0.05}};
    map[at].p.y() = 2.5;
  }
  const PlaceQuery query = queryOf(map, part(), 15.0);
  const auto one = bestMatch(query, kPlace);
  ASSERT_TRUE(one);
  EXPECT_TRUE(isBelieved(*one)) << one->score << " " << one->next << " " << one->cells;
  EXPECT_LT(difference(one->T_MB.mean, {{50.0, 4.0, 1.0}, 10.0 * kDegree}).norm(), 0.3);
}

TEST(Constellation, WhereTheBodyIsKnownWellOneObjectTellsWhichItIs) {
  const auto map = row();
  const auto match = bestMatch(queryOf(map, {map[8]}, 0.5), kPlace);
  ASSERT_TRUE(match);
  ASSERT_EQ(match->pairs.size(), 1u);
  EXPECT_EQ(match->pairs.front(), (std::pair<ObjectId, ObjectId>(9, 9 + kSeen)));
  EXPECT_GT(match->score - match->next, 2.5);
  // No match is returned if the object may also be the neighbour.
  const auto either = bestMatch(queryOf(map, {map[8]}, 15.0), kPlace);
  EXPECT_TRUE(!either || either->score - either->next < 2.5);
}

TEST(Constellation, OfTwoSeenObjectsForOneMapObjectNeitherIsAPair) {
  const auto map = row();
  std::vector<PlacedObject> seen(map.begin() + 6, map.begin() + 12);
  seen.push_back(map[8]);
  seen.back().id = 500;
  const auto match = bestMatch(queryOf(map, seen, 0.5), kPlace);
  ASSERT_TRUE(match);
  EXPECT_EQ(match->pairs.size(), 5u);
  for (const auto& [known, id] : match->pairs) EXPECT_NE(known, 9u);
}

TEST(Constellation, NothingSeenAndNothingOnTheMapGiveNothing) {
  const auto map = row();
  EXPECT_FALSE(bestMatch(queryOf(map, {}, 4.0), kPlace));
  EXPECT_FALSE(bestMatch(queryOf({}, map, 4.0), kPlace));
  EXPECT_FALSE(bestMatch(queryOf({}, {}, 4.0), kPlace));
}

TEST(Constellation, TheSameQueryGivesTheSameMatch) {
  Town town(3);
  const PlaceQuery query{fromBody(town.believed(town.near({10, -5}, 35.0))),
                         town.believed(town.truth()), town.driven(),
                         town.priorOf(kBody, 4.0, 4.0 * kDegree)};
  const auto one = bestMatch(query, kPlace), two = bestMatch(query, kPlace);
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->T_MB.mean.p, two->T_MB.mean.p);
  EXPECT_EQ(one->score, two->score);
  EXPECT_EQ(one->pairs, two->pairs);
}

}  // namespace
}  // namespace perdure::mapping

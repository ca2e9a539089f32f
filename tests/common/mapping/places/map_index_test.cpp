// Compares the index of a map with a search of the whole map.
#include "common/mapping/places/map_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <tuple>

namespace perdure::mapping {
namespace {

constexpr PlaceParameters kIndexed;

struct Scatter {
  std::vector<PlacedObject> objects;
  std::vector<Eigen::Vector2d> driven;
};

/// Objects around a centre on either side of the origin.
Scatter scatter(std::uint32_t seed, std::size_t count, const Eigen::Vector2d& middle) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> any(0.0, 1.0);
  Scatter s;
  for (std::size_t i = 0; i < count; ++i) {
    PlacedObject o;
    o.id = 100 + i;
    o.p << middle.x() + 120.0 * normal(random), middle.y() + 60.0 * normal(random), normal(random);
    const double first = 0.3 + 0.7 * any(random);
    o.pmf = {{static_cast<std::uint32_t>(random() % 4), first}, {7, 1.0 - first}};
    s.objects.push_back(o);
  }
  for (int i = 0; i < 60; ++i) {
    s.driven.emplace_back(middle.x() + 150.0 * normal(random), middle.y() + 90.0 * normal(random));
  }
  return s;
}

const Eigen::Vector2d kMiddles[] = {{0.0, 0.0}, {-5000.0, 3000.0}, {12345.0, -9876.0}};

TEST(MapIndex, VisitsEachObjectInReachAndNoneTwice) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-300.0, 300.0);
  for (const Eigen::Vector2d& middle : kMiddles) {
    const Scatter s = scatter(1, 400, middle);
    const MapIndex index(s.objects, s.driven, kIndexed);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector2d at = middle + Eigen::Vector2d(any(random), any(random));
      std::multiset<std::size_t> visited;
      index.around(at, [&](std::size_t k) { visited.insert(k); });
      for (std::size_t k = 0; k < s.objects.size(); ++k) {
        const double distance = (s.objects[k].p.head<2>() - at).norm();
        if (distance <= MapIndex::kReach_m) {
          EXPECT_EQ(visited.count(k), 1u) << k;
        }
        EXPECT_LE(visited.count(k), 1u) << k;
        if (distance > 3.0 * MapIndex::kReach_m) {
          EXPECT_EQ(visited.count(k), 0u) << k;
        }
      }
    }
  }
}

TEST(MapIndex, HasEachOrderedPairOfTwoClassesOnceByDistance) {
  const Scatter s = scatter(2, 150, {-40.0, 20.0});
  const MapIndex index(s.objects, s.driven, kIndexed);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::set<std::pair<std::size_t, std::size_t>>>
      expected;
  for (std::size_t c = 0; c < s.objects.size(); ++c) {
    for (std::size_t d = 0; d < s.objects.size(); ++d) {
      const double distance = (s.objects[c].p - s.objects[d].p).head<2>().norm();
      if (c == d || distance < kIndexed.pair_least_m || distance > kIndexed.pair_most_m) continue;
      expected[{mostProbable(s.objects[c]), mostProbable(s.objects[d])}].insert({c, d});
    }
  }
  std::size_t all = 0;
  for (std::uint32_t c = 0; c < 9; ++c) {
    for (std::uint32_t d = 0; d < 9; ++d) {
      const auto* pairs = index.pairsOf(c, d);
      const auto wanted = expected.find({c, d});
      ASSERT_EQ(pairs != nullptr, wanted != expected.end()) << c << " " << d;
      if (pairs == nullptr) continue;
      EXPECT_EQ(pairs->size(), wanted->second.size());
      double before = 0.0;
      for (const MapIndex::Pair& pair : *pairs) {
        EXPECT_TRUE(wanted->second.contains({pair.c, pair.d}));
        EXPECT_EQ(pair.distance, (s.objects[pair.c].p - s.objects[pair.d].p).head<2>().norm());
        EXPECT_GE(pair.distance, before);
        before = pair.distance;
      }
      all += pairs->size();
    }
  }
  EXPECT_GT(all, 900u);
}

TEST(MapIndex, KnowsWhatStandsNearTheWay) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-400.0, 400.0);
  for (const Eigen::Vector2d& middle : kMiddles) {
    const Scatter s = scatter(3, 30, middle);
    const MapIndex index(s.objects, s.driven, kIndexed);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector2d at = middle + Eigen::Vector2d(any(random), any(random));
      double nearest = 1e9;
      for (const auto& d : s.driven) nearest = std::min(nearest, (d - at).norm());
      const double reach = kIndexed.known_within_m;
      const double share =
          0.02 + kIndexed.known_share * std::exp(-0.5 * nearest * nearest / (reach * reach));
      EXPECT_NEAR(index.knownShare(at), share, 0.5 * std::exp(-8.0) + 1e-12) << nearest;
    }
  }
}

TEST(MapIndex, CountsClassesAndTellsHowWideTheMapIs) {
  const Scatter s = scatter(4, 200, {-5000.0, 3000.0});
  const MapIndex index(s.objects, s.driven, kIndexed);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), square = Eigen::Vector2d::Zero();
  std::map<std::uint32_t, double> shares;
  for (const PlacedObject& o : s.objects) {
    mean += o.p.head<2>() / 200.0;
    for (const ClassShare& c : o.pmf) shares[c.name] += c.probability / 200.0;
  }
  for (const PlacedObject& o : s.objects) square += (o.p.head<2>() - mean).cwiseAbs2() / 200.0;
  EXPECT_LT((index.centre() - mean).norm(), 1e-6);
  EXPECT_LT((index.spread2() - square).norm(), 1e-6 * square.norm());
  for (const auto& [name, share] : shares) EXPECT_NEAR(index.commonShare(name), share, 1e-12);
  EXPECT_EQ(index.commonShare(1234), 0.0);
}

TEST(MapIndex, OfNothingSaysLittle) {
  const MapIndex index({}, {}, kIndexed);
  std::size_t visited = 0;
  index.around({0.0, 0.0}, [&](std::size_t) { ++visited; });
  EXPECT_EQ(visited, 0u);
  EXPECT_EQ(index.pairsOf(0, 0), nullptr);
  EXPECT_LT(index.knownShare({0.0, 0.0}), 0.021);
  EXPECT_EQ(index.spread2().norm(), 0.0);
}

}  // namespace
}  // namespace perdure::mapping

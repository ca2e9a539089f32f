#include "tools/map/learn_context.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perdure::tools {
namespace {

using map_store::PlacedBelief;

PlacedBelief thing(ObjectId id, const std::string& name, double x, double y, double r = 1.0,
                   double probability = 1.0) {
  PlacedBelief placed;
  placed.world = {7, 1};
  placed.belief.id = id;
  placed.belief.existence = r;
  ClassBelief known, other;
  known.name = name;
  known.probability = probability;
  known.mean.head<2>() << x, y;
  other.name = kOtherClass;
  other.probability = 1.0 - probability;
  other.mean = known.mean;
  placed.belief.classes = {known, other};
  return placed;
}

TEST(LearnContext, CountsPairsAgainstChance) {
  // Two pairs: chair with table (r π of the chair is one half), table with table.
  const auto learnt = learnContext(
      {thing(1, "chair", 0, 0, 0.8, 0.625), thing(2, "table", 1, 0), thing(3, "table", 1, 3)},
      {3.1, 2.0});
  EXPECT_EQ(learnt.objects, 3U);
  EXPECT_EQ(learnt.pairs, 2U);
  // n: chair-table .5 each way, table-table 2; marginals .5 and 2.5; all 3.
  const auto& m = learnt.matrix;
  ASSERT_EQ(m.classes, (std::vector<std::string>{"chair", "table"}));
  EXPECT_NEAR(m.of("chair", "table"), std::log((0.5 + 2.0) / (0.5 * 2.5 / 3.0 + 2.0)), 1e-12);
  EXPECT_NEAR(m.of("table", "table"), std::log((2.0 + 2.0) / (2.5 * 2.5 / 3.0 + 2.0)), 1e-12);
  EXPECT_NEAR(m.of("chair", "chair"), std::log(2.0 / (0.25 / 3.0 + 2.0)), 1e-12);
  EXPECT_EQ(m.of("table", "chair"), m.of("chair", "table"));
  EXPECT_EQ(m.of("table", kOtherClass), 0.0);
  EXPECT_EQ(m.radius_m, 3.1);
}

TEST(LearnContext, FindsWhatStandsTogetherAmongManyThings) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> town(0.0, 2000.0), near(-2.0, 2.0);
  std::vector<PlacedBelief> beliefs;
  for (ObjectId id = 1; id <= 600; id += 3) {
    const double x = town(random), y = town(random), u = town(random), v = town(random);
    beliefs.push_back(thing(id, "table", x, y));
    beliefs.push_back(thing(id + 1, "chair", x + near(random), y + near(random)));
    beliefs.push_back(thing(id + 2, "car", u, v));
    beliefs.push_back(thing(id + 1000, "car", u + near(random), v + near(random)));
  }
  const auto m = learnContext(beliefs, {8.0, 5.0}).matrix;
  EXPECT_GT(m.of("chair", "table"), 0.8);
  EXPECT_GT(m.of("car", "car"), 0.5);
  EXPECT_LT(m.of("car", "chair"), -0.8);
  EXPECT_LT(m.of("chair", "chair"), -0.8);
}

TEST(LearnContext, LooksOnlyWithinOneFrameOfReferenceAndAtWhatStands) {
  PlacedBelief elsewhere = thing(2, "car", 1, 0), moving = thing(3, "car", 0, 1);
  elsewhere.world.epoch = 2;
  moving.belief.moving = 0.9;
  const auto learnt = learnContext({thing(1, "car", 0, 0), elsewhere, moving}, {});
  EXPECT_EQ(learnt.objects, 2U);
  EXPECT_EQ(learnt.pairs, 0U);
  EXPECT_TRUE(learnt.matrix.empty());
}

TEST(LearnContext, LearnsNothingFromItsOwnOutput) {
  const auto pair = [](double nats) {
    PlacedBelief a = thing(1, "car", 0, 0), b = thing(2, "car", 3, 0);
    for (PlacedBelief* each : {&a, &b}) {
      auto& classes = each->belief.classes;
      classes[1].name = "van";
      const double car = 0.6 * std::exp(nats), van = 0.4;
      classes[0].probability = car / (car + van);
      classes[1].probability = van / (car + van);
      for (int k = 0; k < 2; ++k) {
        std::vector<double> row(kClassEvidences, 0.0);
        row[static_cast<std::size_t>(ClassEvidence::kContext)] =
            (k == 0 ? nats : 0.0) - std::log(car + van);
        each->belief.why.classes.push_back({classes[static_cast<std::size_t>(k)].name, row});
      }
    }
    return learnContext({a, b}, {10.0, 1.0}).matrix;
  };
  const auto plain = pair(0.0), laid = pair(0.9);
  EXPECT_TRUE(plain.log_ratio.isApprox(laid.log_ratio, 1e-12));
}

}  // namespace
}  // namespace perdure::tools

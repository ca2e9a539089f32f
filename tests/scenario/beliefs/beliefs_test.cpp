// Bars of the filter's calibration, over fifty worlds that match its model.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/scenario/beliefs/picture.h"
#include "tests/scenario/scenario.h"

namespace perdure::test {
namespace {

std::vector<Bar> inBand(const tools::RunAnees& runs) {
  const auto [low, high] = runs.band();
  return {atLeast(low, "ANEES of " + runs.what + ", lower end of the 95 % band", runs.mean()),
          atMost(high, "ANEES of " + runs.what + ", upper end", runs.mean())};
}

TEST(Beliefs, AreAsSureAsTheyAreRight) {
  const BeliefScores scores = runWorlds({}, readTold(), 50);
  print(scores);
  if (const char* bin = std::getenv("PERDURE_BIN")) {
    drawBeliefs(scores, std::filesystem::path(bin).parent_path() / "tests" / "beliefs.png");
  }
  std::vector<Bar> bars{
      atLeast(1500, "objects asked whether they exist", double(scores.existence.claims.size())),
      atMost(0.05, "expected calibration error of existence", scores.existence.calibrationError()),
      atLeast(0.5, "Brier skill of existence", scores.existence.skill()),
      atMost(0.05, "expected calibration error of the most probable class",
             scores.classes.best().calibrationError()),
      atLeast(0.5, "Brier skill of all classes", scores.classes.skill())};
  for (const auto& more : {inBand(scores.position), inBand(scores.half_yaw), inBand(scores.size)}) {
    bars.insert(bars.end(), more.begin(), more.end());
  }
  hold(bars);
}

}  // namespace
}  // namespace perdure::test

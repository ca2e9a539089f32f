// Tests the reading of the table of known failures, and the effects of a row.
#include "tests/scenario/known_failures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "tests/scenario/bars.h"
#include "tests/scenario/verdict.h"

namespace perdure::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kHeader[] = "scene,run,bar,tolerated,why\n";

std::vector<KnownFailure> readText(const std::string& text) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "perdure_known_failures.csv";
  std::ofstream(file) << text;
  return readKnownFailures(file);
}

std::string refusalOf(const std::string& text) {
  try {
    readText(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "taken";
}

const std::vector<KnownFailure> kAtMostTwo{{"room", "seeds", "jumps", 2.0, "they jump"}};

std::vector<std::string> saidOfJumps(double measured) {
  return complaints(judge({{atMost(0, "jumps", measured)}}), kAtMostTwo);
}

TEST(KnownFailures, AreReadWithCommasAndQuotesInQuotes) {
  const auto rows = readText(std::string(kHeader) +
                             "toy,seeds,\"P(car, exists)\",0.86,\"a \"\"far\"\" car, late\"\n"
                             "toy,vio,jumps,2,they jump\n");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].bar, "P(car, exists)");
  EXPECT_EQ(rows[0].tolerated, 0.86);
  EXPECT_EQ(rows[0].why, "a \"far\" car, late");
  EXPECT_THAT(knownFailures(rows, "toy", "seeds"), ::testing::SizeIs(1));
  EXPECT_THAT(knownFailures(rows, "toy", "recalled"), IsEmpty());
}

TEST(KnownFailures, AreRefusedByLineWhereTheTableIsWrong) {
  const std::string head = kHeader;
  EXPECT_THAT(refusalOf(""), HasSubstr("is empty or missing"));
  EXPECT_THAT(refusalOf("scene,bar\n"), HasSubstr(":1: is not scene,run"));
  EXPECT_THAT(refusalOf(head + "toy,seeds,jumps,2\n"), HasSubstr(":2: is not scene,run"));
  EXPECT_THAT(refusalOf(head + "toy,seeds,jumps,two,why\n"), HasSubstr(":2: `two` is not a"));
  EXPECT_THAT(refusalOf(head + "toy,seeds,jumps,2,\n"), HasSubstr(":2: a field is empty"));
  EXPECT_THAT(refusalOf(head + "toy,seeds,jumps,2,a\ntoy,seeds,jumps,3,b\n"),
              HasSubstr(":3: the bar has a row already"));
}

TEST(KnownFailures, OfTheSourcesAreOfScenesAndRunsThatAreTested) {
  const auto rows = readKnownFailures(knownFailuresFile());
  const auto& scenes = scenesWithBars();
  for (const auto& row : rows) {
    const bool scene = std::find(scenes.begin(), scenes.end(), row.scene) != scenes.end();
    const bool run =
        row.run == "seeds" || row.run == "vio" || (row.run == "recalled" && row.scene == "street");
    EXPECT_TRUE(scene && run) << row.scene << ' ' << row.run << ": " << row.bar;
  }
}

TEST(KnownFailures, ABarThatPassesMustLoseItsRow) {
  EXPECT_THAT(saidOfJumps(0), ElementsAre(HasSubstr("passes now")));
}

TEST(KnownFailures, AValueWithinTheLimitIsTolerated) {
  EXPECT_THAT(saidOfJumps(1), IsEmpty());
  EXPECT_THAT(saidOfJumps(2), IsEmpty());
}

TEST(KnownFailures, AValueThatIsWorseThanTheLimitFails) {
  EXPECT_THAT(saidOfJumps(2.1), ElementsAre(HasSubstr("worse than the 2")));
  EXPECT_THAT(saidOfJumps(std::nan("")), ElementsAre(HasSubstr("worse than the 2")));
}

TEST(KnownFailures, TheWorstSeedIsHeldAgainstALowerLimitToo) {
  const std::vector<KnownFailure> known{{"row", "seeds", "found", 5.0, "far"}};
  const auto said = [&](double a, double b) {
    return complaints(judge({{atLeast(10, "found", a)}, {atLeast(10, "found", b)}}), known);
  };
  EXPECT_THAT(said(9, 5), IsEmpty());
  EXPECT_THAT(said(9, 4), ElementsAre(HasSubstr("found is 4, worse than the 5")));
  EXPECT_THAT(said(10, 10), ElementsAre(HasSubstr("passes now")));
  EXPECT_THAT(said(9, std::nan("")), ElementsAre(HasSubstr("worse")));
}

TEST(KnownFailures, ABarWithoutARowMustPass) {
  EXPECT_THAT(complaints(judge({{atMost(0, "falls", 1)}}), {}),
              ElementsAre("falls is 1 and must be 0"));
  EXPECT_THAT(complaints(judge({{atMost(0, "falls", 0)}}), {}), IsEmpty());
}

TEST(KnownFailures, ARowThatNoBarIsCalledLikeOrThatToleratesNothingFails) {
  EXPECT_THAT(complaints(judge({{atMost(0, "falls", 0)}}), kAtMostTwo),
              ElementsAre("no bar is called: jumps"));
  EXPECT_THAT(complaints(judge({{atMost(3, "jumps", 4)}}), kAtMostTwo),
              ElementsAre(HasSubstr("does not forbid")));
}

}  // namespace
}  // namespace perdure::test

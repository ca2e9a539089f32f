#include "tools/map/why.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/types/ledger_json.h"

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TimePoint at(double seconds) { return TimePoint{} + durationFromSeconds(seconds); }

LedgerEntry& entryOf(ObjectBelief& o, ExistenceEvidence kind) {
  return o.why.existence[static_cast<std::size_t>(kind)];
}

ObjectBelief carBelief() {
  ObjectBelief o;
  o.id = 17;
  o.first_seen = at(101.3);
  o.last_seen = at(113.7);
  o.why.existence.resize(kExistenceEvidences);
  entryOf(o, ExistenceEvidence::kPrior) = {-1.61, 1, at(101.3), at(101.3)};
  entryOf(o, ExistenceEvidence::kHit) = {9.2, 31, at(101.3), at(113.7)};
  entryOf(o, ExistenceEvidence::kRepeated) = {0.31, 1, at(104.0), at(104.0)};
  entryOf(o, ExistenceEvidence::kMiss) = {-2.1, 4, at(105.0), at(106.5)};
  entryOf(o, ExistenceEvidence::kUnmappedOccluder) = {0.9, 4, at(105.0), at(106.5)};
  entryOf(o, ExistenceEvidence::kHidden) = {0.0, 210, at(107.0), at(112.0)};
  entryOf(o, ExistenceEvidence::kTime) = {-0.004, 246, at(101.4), at(113.7)};
  o.existence = 1.0 / (1.0 + std::exp(-o.why.logOdds()));
  o.classes.resize(2);
  o.classes[0].name = "car";
  o.classes[0].probability = 0.93;
  o.classes[1].name = kOtherClass;
  o.classes[1].probability = 0.07;
  o.why.classes = {{"car", {-0.5, 0.4, std::log(0.93) + 0.1}}, {kOtherClass, {-4.6, 0.0, 1.9}}};
  o.why.classes[1].log_odds[1] = std::log(0.07) + 4.6 - 1.9;
  o.why.ousted = {{"van", "car", at(104.1), {0.7, 3.2, 1.4}}};
  return o;
}

TEST(Why, TellsAnObjectEntryByEntry) {
  EXPECT_EQ(
      toWhy(carBelief()),
      R"(Object 17 exists with probability 0.999; if it does, it is a car with probability 0.930.
It was first seen at 101.300 s, and last 12.400 s later.

That it exists, in log-odds (+0.69 doubles the odds, +2.30 makes them tenfold):
     -1.61  before its first box: few boxes are new objects
     +9.20  detected in 31 observations (101.300 s to 113.700 s)
     +0.31  detected in 1 observation more from the same place: little weight (at 104.000 s)
     -2.10  not detected in 4 observations of its place (105.000 s to 106.500 s)
     +0.90  of these excused: an object that is not on the map may have occluded it
     +0.00  210 observations not used: it was occluded (107.000 s to 112.000 s)
     +0.00  time passed: objects leave
     +6.70  together

It is a car rather than something of no known class (0.070), 13.3 to 1:
     +4.10  how frequent the two are
     +0.36  activations of the network in its boxes
     -1.87  how well size and place explain the boxes
     +2.59  together

That it is a van was given up at 104.100 s; a car was the better one, 200.3 to 1:
     +0.70  how frequent the two are
     +3.20  activations of the network in its boxes
     +1.40  how well size and place explain the boxes
     +5.30  together
)");
}

TEST(Why, SaysThatThereIsNoLedger) {
  ObjectBelief o = carBelief();
  o.why = {};
  EXPECT_THAT(toWhy(o), HasSubstr("Its ledger is empty"));
  EXPECT_THAT(toWhy(o), Not(HasSubstr("together")));
  EXPECT_TRUE(toJson(o.why).is_null());
}

TEST(Why, SaysWhereALedgerDoesNotAddUp) {
  EXPECT_THAT(toWhy(carBelief()), Not(HasSubstr("faulty")));
  ObjectBelief o = carBelief();
  entryOf(o, ExistenceEvidence::kHit).log_odds += 1e-4;
  EXPECT_THAT(toWhy(o), HasSubstr("the ledger is faulty"));
  o = carBelief();
  o.why.classes.pop_back();
  EXPECT_THAT(toWhy(o), HasSubstr("The ledger does not say why"));
}

TEST(Why, ShowsEvidenceOfKindsThatItDoesNotKnow) {
  ObjectBelief o = carBelief();
  o.why.existence.push_back({1.5, 2, at(102.0), at(103.0)});
  o.existence = 1.0 / (1.0 + std::exp(-o.why.logOdds()));
  EXPECT_THAT(toWhy(o), HasSubstr("+1.50  evidence of a kind that this program does not know"));
  EXPECT_EQ(toJson(o.why)["existence"]["kind_" + std::to_string(kExistenceEvidences)]["count"], 2);
}

TEST(Why, NamesKindsInJson) {
  const auto json = toJson(carBelief().why);
  EXPECT_EQ(json["existence"]["hit"]["log_odds"], 9.2);
  EXPECT_EQ(json["existence"]["hit"]["count"], 31);
  EXPECT_EQ(json["existence"]["hit"]["first_ns"], 101'300'000'000);
  EXPECT_FALSE(json["existence"].contains("lost"));
  EXPECT_EQ(json["classes"]["car"]["activation"], 0.4);
  EXPECT_EQ(json["ousted"][0]["class"], "van");
  EXPECT_EQ(json["ousted"][0]["log_odds"]["geometry"], 1.4);
}

}  // namespace
}  // namespace perdure::tools

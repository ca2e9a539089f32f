// Corrections of people in the published objects: the filter's own belief does not contain them.
#include "services/semantic_filter/corrections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/services/semantic_filter/memory_run.h"
#include "tests/support/corrections.h"

namespace perdure::semantic_filter {
namespace {

using namespace testing;        // NOLINT(google-build-using-namespace)
using namespace perdure::test;  // NOLINT(google-build-using-namespace)
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr auto kPerson = static_cast<std::size_t>(ExistenceEvidence::kPerson);

std::vector<ObjectId> idsOf(const Objects& objects) {
  std::vector<ObjectId> ids;
  for (const ObjectBelief& belief : objects.objects) ids.push_back(belief.id);
  return ids;
}

TEST(Corrections, WithoutThemAMessageIsUnchanged) {
  Objects objects = map_store::test::workingSet(1, {map_store::test::carAt(1, {0, 0, 0})});
  const double existence = objects.objects[0].existence;
  Corrections corrections;
  corrections.take({});
  corrections.apply(objects);
  EXPECT_THAT(objects.as_estimated, IsEmpty());
  EXPECT_EQ(objects.objects[0].existence, existence);
}

TEST(Corrections, OfJoinedTracksTheOneDetectedLastIsShown) {
  using map_store::test::carAt;
  Objects objects = map_store::test::workingSet(
      1, {carAt(1, {0, 0, 0}), carAt(2, {5, 0, 0}), carAt(3, {9, 0, 0}), carAt(4, {20, 0, 0})});
  objects.objects[1].last_seen += std::chrono::seconds(1);
  Corrections corrections;
  corrections.take(
      {ofTwo(CorrectionKind::kSame, 3, 1, 0.0, 1), ofTwo(CorrectionKind::kSame, 2, 3, 0.0, 2)});
  corrections.apply(objects);
  EXPECT_THAT(idsOf(objects), ElementsAre(1u, 4u));
  EXPECT_EQ(objects.objects[0].trackId(), 2u);
  EXPECT_EQ(objects.objects[0].best().mean.x(), 5.0);
  ASSERT_THAT(objects.as_estimated, SizeIs(3));
  for (const ObjectBelief& own : objects.as_estimated) EXPECT_EQ(own.id, own.trackId());
}

TEST(Corrections, EventsAndOccludersHaveTheIdsOfJoinedObjects) {
  using map_store::test::carAt;
  Objects objects = map_store::test::workingSet(
      1, {carAt(1, {0, 0, 0}), carAt(2, {5, 0, 0}), carAt(4, {20, 0, 0})});
  objects.objects[1].last_seen += std::chrono::seconds(1);
  objects.objects[2].blocked_by = 2;
  Corrections corrections;
  corrections.take({ofTwo(CorrectionKind::kSame, 2, 1, 0.0, 1)});
  corrections.apply(objects);
  EXPECT_EQ(objects.objects.at(1).blocked_by, 1u);
  EXPECT_EQ(objects.as_estimated.at(2).blocked_by, 2u);
  std::vector<Event> events(5);
  events[0].object_id = 1;  // its track is not shown
  events[1].object_id = 2;
  events[2].object_id = 4, events[2].other_id = 2;
  events[3].object_id = 5;
  events[4].kind = EventKind::kMerged;  // of tracks that a person joined before
  events[4].object_id = 2, events[4].other_id = 1;
  corrections.apply(events, objects);
  ASSERT_THAT(events, SizeIs(3));
  EXPECT_EQ(events[0].object_id, 1u);
  EXPECT_EQ(events[1].other_id, 1u);
  EXPECT_EQ(events[2].object_id, 5u);
  objects.objects.erase(objects.objects.begin());
  events[0].object_id = 1;
  corrections.apply(events, objects);
  EXPECT_THAT(events, SizeIs(3)) << "the object is gone with its last track";
}

/// Two runs of the same drive; only in one, a person states that a car is not there.
TEST(Corrections, AnObjectFallsAndTheFiltersOwnBeliefStaysAsItWas) {
  Pair corrected, plain;
  for (Pair* pair : {&corrected, &plain}) pair->driveTo(8.0);
  const ObjectId car = *plain.confirmed().begin();
  corrected.map->onCorrection({1, 1, notThere(car, 10.0)});
  for (Pair* pair : {&corrected, &plain}) pair->driveTo(10.0);
  const Objects &shown = corrected.objects.back(), &expected = plain.objects.back();
  const auto of = [&](const auto& list) {
    return *std::ranges::find(list, car, &ObjectBelief::id);
  };
  const ObjectBelief fallen = of(shown.objects), usual = of(expected.objects);
  EXPECT_NEAR(logOdds(fallen.existence), logOdds(usual.existence) - 10.0, 1e-6);
  EXPECT_NEAR(fallen.why.logOdds(), logOdds(fallen.existence), 1e-6);
  EXPECT_EQ(fallen.why.existence.at(kPerson).log_odds, -10.0);
  EXPECT_FALSE(fallen.confirmed);
  ASSERT_THAT(shown.as_estimated, SizeIs(1));
  EXPECT_EQ(map_store::encodeBelief(shown.as_estimated[0]), map_store::encodeBelief(usual));
  corrected.map->onCorrection({1, 2, withdrawal(1)});
  for (Pair* pair : {&corrected, &plain}) pair->driveTo(11.0);
  EXPECT_THAT(corrected.objects.back().as_estimated, IsEmpty());
  ASSERT_EQ(idsOf(corrected.objects.back()), idsOf(plain.objects.back()));
  for (std::size_t i = 0; i < plain.objects.back().objects.size(); ++i) {
    EXPECT_EQ(map_store::encodeBelief(corrected.objects.back().objects[i]),
              map_store::encodeBelief(plain.objects.back().objects[i]));
  }
}

TEST(Corrections, JoinedTracksStayTwoInTheFilter) {
  Pair pair;
  pair.driveTo(8.0);
  const auto cars = pair.confirmed();
  ASSERT_GE(cars.size(), 2u);
  const ObjectId a = *cars.begin(), b = *std::next(cars.begin());
  const std::size_t tracks = pair.filter.belief().tracks.size();
  pair.map->onCorrection({1, 1, ofTwo(CorrectionKind::kSame, b, a)});
  pair.driveTo(9.0);
  EXPECT_EQ(pair.filter.belief().tracks.size(), tracks);
  EXPECT_THAT(pair.objects.back().as_estimated, SizeIs(2));
  EXPECT_FALSE(pair.confirmed().contains(b));
  pair.map->onCorrection({1, 2, withdrawal(1)});
  pair.driveTo(10.0);
  EXPECT_TRUE(pair.confirmed().contains(a) && pair.confirmed().contains(b));
}

}  // namespace
}  // namespace perdure::semantic_filter

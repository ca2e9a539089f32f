#include "common/mapping/fusion/session_identity.h"

#include <gtest/gtest.h>

#include "tests/common/mapping/fusion/drives.h"

namespace perdure::mapping {
namespace {

const std::vector<test::Thing>& block() {
  static const auto all = test::thingsAlongBlock(1);
  return all;
}

SessionIdentity identityOf(const SavedMap& map) { return sessionsOf(map).front().identity; }

TEST(SessionIdentity, IsThatOfTheSameDriveWhateverItsNumbersAre) {
  const auto before = test::driven(block(), {.to_m = 100.0}).map.graph;
  SavedMap now = before;
  now.anchors.clear();
  for (auto [id, saved] : before.anchors) {
    saved.anchor.id = id + 100;
    if (saved.anchor.previous != 0) saved.anchor.previous += 100;
    saved.anchor.session = {9, 3};
    saved.anchor.from_previous.covariance *= 4.0;
    saved.T_MA.p.x() += 17.0;
    now.anchors[id + 100] = saved;
  }
  EXPECT_EQ(identityOf(now), identityOf(before));
}

TEST(SessionIdentity, DiffersBetweenDrivesAndByEveryBitOfTheFirstAnchors) {
  const auto one = test::driven(block(), {.seed = 1, .to_m = 60.0}).map.graph;
  const auto two = test::driven(block(), {.seed = 2, .to_m = 60.0}).map.graph;
  EXPECT_FALSE(identityOf(one).matches(identityOf(two))) << "the increments drift differently";
  SavedMap later = one;
  later.anchors.begin()->second.anchor.stamp.time += Duration(1);
  EXPECT_FALSE(identityOf(one).matches(identityOf(later)));
}

TEST(SessionIdentity, MatchesWhileOneOfTheMapsKnowsOneAnchorOnly) {
  const auto whole = test::driven(block(), {.to_m = 60.0}).map.graph;
  SavedMap begun = whole;
  begun.anchors.erase(std::next(begun.anchors.begin()), begun.anchors.end());
  EXPECT_EQ(identityOf(begun).second, 0u);
  EXPECT_TRUE(identityOf(begun).matches(identityOf(whole)));
  EXPECT_TRUE(identityOf(whole).matches(identityOf(begun)));
}

TEST(SessionIdentity, SessionsComeInTheOrderOfTheirFirstAnchors) {
  SavedMap map = test::driven(block(), {.to_m = 60.0}).map.graph;
  const auto other = test::driven(block(), {.seed = 2, .to_m = 60.0, .world = {4, 0}}).map.graph;
  for (auto [id, saved] : other.anchors) {
    saved.anchor.id = id + 50;
    if (saved.anchor.previous != 0) saved.anchor.previous += 50;
    map.anchors[id + 50] = saved;
  }
  const auto sessions = sessionsOf(map);
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].world, (WorldId{1, 0}));
  EXPECT_EQ(sessions[1].world, (WorldId{4, 0}));
  EXPECT_EQ(find(sessions, identityOf(other)), &sessions[1]);
  EXPECT_EQ(find(sessions, {1, 2}), nullptr);
}

}  // namespace
}  // namespace perdure::mapping

// Facts, the objects that follow from them, and the records of objects with several tracks.
#include "common/mapping/identity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include "common/mapping/map_state.h"
#include "tests/common/mapping/synthetic_drive.h"
#include "tests/support/corrections.h"

namespace perdure::mapping {
namespace {

using namespace test;

constexpr TrackId kTracks = 24;
constexpr EdgeId kLoops = 6;

SameObject anyFact(std::mt19937& random) {
  return {random() % (kLoops + 1), 1 + random() % kTracks, 1 + random() % kTracks};
}

std::vector<SameObject> anyFacts(std::mt19937& random) {
  std::vector<SameObject> facts(1 + random() % 20);
  for (SameObject& fact : facts) fact = anyFact(random);
  return facts;
}

Identity of(const std::vector<SameObject>& facts) {
  Identity identity;
  for (const SameObject& fact : facts) identity.add(fact);
  return identity;
}

std::vector<SameObject> without(EdgeId loop, std::vector<SameObject> facts) {
  std::erase_if(facts, [loop](const SameObject& fact) { return fact.loop == loop; });
  return facts;
}

void expectSameIdentity(const Identity& a, const Identity& b, std::uint32_t seed) {
  EXPECT_EQ(a.facts(), b.facts()) << seed;
  EXPECT_EQ(a.shared(), b.shared()) << seed;
  for (TrackId track = 0; track <= kTracks + 1; ++track) {
    EXPECT_EQ(a.objectOf(track), b.objectOf(track)) << seed << ", track " << track;
    EXPECT_EQ(a.isShared(track), b.isShared(track)) << seed << ", track " << track;
  }
}

template <class Test>
void forSeeds(const Test& test) {
  for (std::uint32_t seed = 1; seed <= 100; ++seed) {
    std::mt19937 random(seed);
    test(random, seed);
  }
}

TEST(Identity, PeopleJoinObjectsThatTheFilterDoesNotFuse) {
  Identity identity({{3, 5, 6}});
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kSame, 5, 2, 10.0)});
  EXPECT_EQ(identity.objectOf(6), 2u);
  EXPECT_EQ(identity.observedObjectOf(6), 5u);
  EXPECT_EQ(identity.observedObjectOf(2), 2u);
  Correction withdrawn = perdure::test::ofTwo(CorrectionKind::kSame, 5, 2, 10.0);
  withdrawn.withdrawn = true;
  identity.setCorrections({withdrawn});
  EXPECT_EQ(identity.objectOf(6), 5u);
  EXPECT_FALSE(identity.isShared(2));
}

TEST(Identity, TheStrongerEvidenceDecidesWhetherTwoTracksAreOne) {
  Identity identity({{3, 5, 6}, {4, 6, 7}});
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kDifferent, 5, 7, 7.9)});
  EXPECT_EQ(identity.objectOf(7), 5u);  // a loop has 8 nats
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kDifferent, 7, 5, 8.1)});
  EXPECT_EQ(identity.objectOf(6), 5u);
  EXPECT_EQ(identity.objectOf(7), 7u);
  EXPECT_FALSE(identity.isShared(7));
  // A second person contradicts the first one.
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kDifferent, 7, 5, 8.1),
                           perdure::test::ofTwo(CorrectionKind::kSame, 7, 5, 8.1, 2)});
  EXPECT_EQ(identity.objectOf(7), 5u);
}

TEST(Identity, AMergeByTheFilterOutweighsPeople) {
  Identity identity({{0, 5, 6}});
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kDifferent, 5, 6, 50.0)});
  EXPECT_EQ(identity.objectOf(6), 5u);
}

TEST(Identity, ALoopThatPeopleContradictDoesNotJoinLater) {
  Identity identity;
  identity.setCorrections({perdure::test::ofTwo(CorrectionKind::kDifferent, 5, 6, 10.0)});
  identity.add({9, 5, 6});
  EXPECT_FALSE(identity.isShared(5));
  EXPECT_EQ(identity.factsOf(9).size(), 1u);
}

TEST(Identity, TheSameFactsInAnyOrderGiveTheSameObjects) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    auto facts = anyFacts(random);
    const Identity identity = of(facts);
    facts.insert(facts.end(), facts.begin(), facts.end());  // each fact occurs twice
    std::shuffle(facts.begin(), facts.end(), random);
    expectSameIdentity(of(facts), identity, seed);
    expectSameIdentity(Identity(identity.facts()), identity, seed);
  });
}

TEST(Identity, TheIdOfAnObjectIsTheLowestOfItsTracks) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    const auto facts = anyFacts(random);
    const Identity identity = of(facts);
    std::map<TrackId, TrackId> lowest;  // propagated along the facts until nothing changes
    for (TrackId track = 1; track <= kTracks; ++track) lowest[track] = track;
    for (TrackId round = 0; round < kTracks; ++round) {
      for (const SameObject& fact : facts) {
        lowest[fact.a] = lowest[fact.b] = std::min(lowest[fact.a], lowest[fact.b]);
      }
    }
    std::map<ObjectId, std::vector<TrackId>> shared;
    for (const auto& [track, object] : lowest) {
      EXPECT_EQ(identity.objectOf(track), object) << seed << ", track " << track;
      shared[object].push_back(track);
    }
    std::erase_if(shared, [](const auto& each) { return each.second.size() < 2; });
    EXPECT_EQ(identity.shared(), shared) << seed;
    for (TrackId id = 1; id <= kTracks; ++id) {
      const auto at = shared.find(id);
      EXPECT_EQ(identity.tracksOf(id), at == shared.end() ? std::vector<TrackId>() : at->second);
      EXPECT_EQ(identity.isShared(id), shared.contains(lowest.at(id))) << seed << ", track " << id;
    }
  });
}

TEST(Identity, WhenALoopEndsAllIsAsItWouldBeWithoutIt) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    auto facts = anyFacts(random);
    Identity identity = of(facts);
    for (int ended = 0; ended < 4; ++ended) {
      const EdgeId loop = 1 + random() % kLoops;
      identity.endLoop(loop);
      EXPECT_TRUE(identity.factsOf(loop).empty()) << seed;
      facts = without(loop, facts);
      expectSameIdentity(identity, of(facts), seed);
      for (const SameObject& fact : anyFacts(random)) {  // and other facts are added
        identity.add(fact);
        facts.push_back(fact);
      }
    }
  });
}

TEST(Identity, ALoopThatTakesTheFactsOfAnotherKeepsTheObjects) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    const auto facts = anyFacts(random);
    Identity identity = of(facts);
    const EdgeId loop = 1 + random() % kLoops;
    const EdgeId by = random() % 2 == 0 ? kLoops + 1 : 1 + loop % kLoops;
    const auto shared = identity.shared();
    identity.replaceLoop(loop, by);
    EXPECT_EQ(identity.shared(), shared) << seed;
    EXPECT_TRUE(identity.factsOf(loop).empty()) << seed;
    identity.endLoop(loop);
    EXPECT_EQ(identity.shared(), shared) << seed;
    expectSameIdentity(Identity(identity.facts()), identity, seed);
    identity.endLoop(by);
    expectSameIdentity(identity, of(without(by, without(loop, facts))), seed);
  });
}

TEST(Identity, FactsOfTheFilterStayWhateverLoopsEnd) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    const auto facts = anyFacts(random);
    Identity identity = of(facts);
    const auto of_filter = identity.factsOf(0);
    for (EdgeId loop = 1; loop <= kLoops; ++loop) identity.endLoop(loop);
    EXPECT_EQ(identity.factsOf(0), of_filter) << seed;
    EXPECT_EQ(identity.facts(), (std::set<SameObject>(of_filter.begin(), of_filter.end()))) << seed;
    expectSameIdentity(identity, of(of_filter), seed);
  });
}

// Tests of the records of objects.

constexpr EdgeId kOneLoop = 50;
const WorldId kSessions[] = {{1, 0}, {2, 0}};

MapState emptyMap() {
  MapState state({}, {});
  for (AnchorId id = 1; id <= 6; ++id) {
    Anchor anchor;
    anchor.id = id;
    anchor.session = kSessions[id > 3];
    state.add(anchor);
  }
  state.follow(kSessions[1]);
  return state;
}

Sighting anySighting(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Sighting sighting{1 + random() % 6, {}};
  sighting.in_anchor.p = {normal(random), normal(random), normal(random)};
  sighting.in_anchor.yaw = normal(random);
  sighting.in_anchor.covariance = (0.1 + std::abs(normal(random))) * Eigen::Matrix4d::Identity();
  return sighting;
}

ObjectRecord detected(std::mt19937& random, double seconds, bool confirmed = true) {
  ObjectRecord record;
  record.sighting = anySighting(random);
  record.session = kSessions[record.sighting.anchor > 3];
  record.way_m = 20.0 * seconds;
  record.last_seen = TimePoint(durationFromSeconds(seconds));
  record.pose_error = 0.01 * seconds * Matrix6d::Identity();
  record.confirmed = confirmed;
  return record;
}

void expectSameRecords(const MapState& a, const MapState& b, const std::string& what) {
  expectSame(a.records(), b.records(), what);
  EXPECT_EQ(a.unconfirmed(), b.unconfirmed()) << what;
  EXPECT_EQ(a.identity().facts(), b.identity().facts()) << what;
  for (AnchorId id = 1; id <= 6; ++id) EXPECT_EQ(a.seenFrom(id), b.seenFrom(id)) << what;
  for (TrackId id = 1; id <= kTracks; ++id) {
    const ObjectRecord *of_a = a.recordOfTrack(id), *of_b = b.recordOfTrack(id);
    ASSERT_EQ(of_a == nullptr, of_b == nullptr) << what << ", track " << id;
    if (of_a != nullptr) expectSame(*of_a, *of_b, what + ", track " + std::to_string(id));
  }
}

/// Two tracks of one object, of which the second was detected later, and a third track.
class JoinedTracks : public ::testing::Test {
 protected:
  JoinedTracks() {
    put(1, 10.0);
    put(2, 20.0);
    put(3, 30.0);
    alone_ = state_;
    state_.unite({kOneLoop, 2, 1});
  }
  /// A record in the session that is followed.
  ObjectRecord now(double seconds) {
    ObjectRecord record = detected(random_, seconds);
    record.session = kSessions[1];
    return record;
  }
  void put(TrackId id, double seconds) { state_.put(id, now(seconds)); }

  std::mt19937 random_{5};
  MapState state_ = emptyMap(), alone_ = emptyMap();
};

TEST_F(JoinedTracks, TheRecordOfAnObjectIsThatOfItsNewestTrack) {
  ASSERT_EQ(state_.records().size(), 2u);
  const ObjectRecord& object = state_.records().at(1);
  EXPECT_EQ(object.last_seen, alone_.records().at(2).last_seen);
  expectSame(object.sighting, alone_.records().at(2).sighting, "newest");
  ASSERT_TRUE(object.earlier);
  expectSame(*object.earlier, alone_.records().at(1).sighting, "before");
  EXPECT_TRUE(state_.seenFrom(object.sighting.anchor).contains(1));
  put(1, 40.0);
  EXPECT_EQ(state_.records().at(1).sighting.in_anchor.id, 1u)
      << "detected again as the first track";
  EXPECT_EQ(state_.records().at(1).earlier->in_anchor.id, 2u);
}

/// The sensor clock restarts with the computer, so a later session can have smaller times.
TEST(Records, TheNewerOfTwoEarlierSessionsIsThatWithTheLaterAnchor) {
  MapState state = emptyMap();
  state.follow({3, 0});
  std::mt19937 random(5);
  for (const TrackId id : {1, 2}) {
    ObjectRecord record = detected(random, id == 1 ? 5000.0 : 10.0);
    record.sighting.anchor = id == 1 ? 2 : 5;
    record.session = kSessions[id - 1];
    state.put(id, record);
  }
  state.unite({kOneLoop, 2, 1});
  EXPECT_EQ(state.records().at(1).sighting.anchor, 5u);
  EXPECT_EQ(state.records().at(1).earlier->anchor, 2u);
}

/// The first track was detected again on this visit before the second one was joined with it.
TEST_F(JoinedTracks, TheEarlierSightingIsOfAnotherVisit) {
  MapState state = emptyMap();
  ObjectRecord first = now(10.0);
  state.put(1, first);
  const Sighting before = state.recordOfTrack(1)->sighting;
  first = now(20.0);
  first.earlier = before;
  state.put(1, first);
  state.put(2, now(20.5));
  state.unite({kOneLoop, 1, 2});
  const ObjectRecord& object = state.records().at(1);
  EXPECT_EQ(object.sighting.in_anchor.id, 2u);
  ASSERT_TRUE(object.earlier);
  expectSame(*object.earlier, before, "of the visit before");
}

TEST_F(JoinedTracks, AreAsBeforeAfterTheRetraction) {
  state_.removeLoop(kOneLoop);
  expectSameRecords(state_, alone_, "both");
}

TEST_F(JoinedTracks, WhatWasDetectedInBetweenStaysWithItsTrack) {
  for (const TrackId again : {1u, 2u}) {
    MapState joined = state_, alone = alone_;
    const ObjectRecord record = now(40.0);
    for (MapState* state : {&joined, &alone}) state->put(again, record);
    EXPECT_EQ(joined.records().at(1).sighting.in_anchor.id, again);
    joined.removeLoop(kOneLoop);
    expectSameRecords(joined, alone, "detected again: " + std::to_string(again));
  }
}

TEST_F(JoinedTracks, ATrackThatEndedEndsItsObjectOnlyWhileItIsTheNewest) {
  MapState older = state_, newer = state_;
  older.end(1);
  ASSERT_TRUE(older.records().contains(1)) << "it was detected since as the other track";
  EXPECT_EQ(older.records().at(1).sighting.in_anchor.id, 2u);
  EXPECT_FALSE(older.records().at(1).earlier) << "nothing that has ended is searched for";
  newer.end(2);
  EXPECT_FALSE(newer.records().contains(1));
  MapState again = newer;
  again.put(1, now(40.0));
  EXPECT_TRUE(again.records().contains(1)) << "detected since as the other track";

  older.removeLoop(kOneLoop);
  EXPECT_FALSE(older.records().contains(1));
  expectSame(older.records().at(2), alone_.records().at(2), "the other one is there");
  newer.removeLoop(kOneLoop);
  EXPECT_FALSE(newer.records().contains(2));
  expectSame(newer.records().at(1), alone_.records().at(1), "the other one is there again");
}

TEST_F(JoinedTracks, AMergeOfTheFilterOutlivesTheLoop) {
  for (MapState* state : {&state_, &alone_}) {
    state->erase(3);
    state->unite({0, 2, 3});
  }
  EXPECT_EQ(state_.identity().objectOf(3), 1u);
  state_.removeLoop(kOneLoop);
  EXPECT_EQ(state_.identity().objectOf(3), 2u);
  expectSameRecords(state_, alone_, "two and three");
}

TEST(Records, AreAfterTheRetractionAsTheyWouldBeWithoutTheLoop) {
  forSeeds([](std::mt19937& random, std::uint32_t seed) {
    MapState state = emptyMap(), without = emptyMap();
    const auto both = [&](const auto& act) {
      act(state);
      act(without);
    };
    const auto isThere = [&](TrackId id) {
      const ObjectRecord* record = without.recordOfTrack(id);
      return record != nullptr && !record->gone;
    };
    for (int step = 1; step <= 120; ++step) {
      const auto any = random() % 100;
      const TrackId a = 1 + random() % kTracks, b = 1 + random() % kTracks;
      if (any < 50) {
        ObjectRecord record = detected(random, step, random() % 4 > 0);
        if (random() % 3 == 0) record.earlier = anySighting(random);
        both([&](MapState& s) { s.put(a, record); });
      } else if (any < 60) {
        both([&](MapState& s) { s.end(a); });
      } else if (any < 65) {
        both([&](MapState& s) { s.erase(a); });
      } else if (any < 75) {
        const EdgeId ended = 1 + random() % kLoops;
        both([&](MapState& s) { s.removeLoop(ended); });
      } else if (a != b && isThere(a) && isThere(b)) {
        if (random() % 2 == 0) {
          state.unite({kOneLoop, a, b});
        } else {
          const EdgeId loop = random() % (kLoops + 1);
          both([&](MapState& s) { s.unite({loop, a, b}); });
        }
      }
    }
    state.removeLoop(kOneLoop);
    expectSameRecords(state, without, "seed " + std::to_string(seed));
  });
}

TEST(Records, OfAnObjectOutliveTheProcessWithTheFactsOfItsLoop) {
  Drive drive({.seed = 1, .yaw_walk = 0.002, .way_m = 3.0 * kLap_m});
  drive.toTheFirstLoop();
  ASSERT_FALSE(drive.loops().empty());
  const Identity before = drive.mapper().identity();
  const EdgeId loop = drive.loops().front().id;
  const auto facts = before.factsOf(loop);
  ASSERT_FALSE(facts.empty());
  EXPECT_TRUE(drive.mapper().graph().edges().contains(loop));
  for (const SameObject& fact : facts) {
    EXPECT_EQ(before.objectOf(fact.b), before.objectOf(fact.a));
    EXPECT_LT(fact.a, fact.b);
    EXPECT_FALSE(drive.mapper().holds(fact.b));
  }
  const SavedMap saved = drive.whole();
  drive.restart();
  EXPECT_EQ(drive.mapper().identity().facts(), before.facts());
  EXPECT_EQ(drive.mapper().identity().shared(), before.shared());
  expectSame(drive.whole(), saved);
  EXPECT_TRUE(isEmpty(drive.mapper().unsaved()));
  drive.toTheEnd();
  EXPECT_EQ(drive.wrong(), 0u);
  std::size_t kept = 0;
  for (const SameObject& fact : facts) kept += drive.objectOf(fact.b) == before.objectOf(fact.a);
  EXPECT_EQ(kept, facts.size()) << "on a whole lap nothing contradicts it";
}

}  // namespace
}  // namespace perdure::mapping

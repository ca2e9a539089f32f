// Compares the changes to save, step by step, with the whole state.
#include "common/mapping/map_state.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/common/mapping/stored_map.h"

namespace perdure::mapping {
namespace {

using test::apply;
using test::expectSame;
using test::isEmpty;
using test::keysOf;

constexpr WorldId kOlder{1, 0}, kYounger{2, 0};

Anchor anchorAt(AnchorId id, AnchorId previous, const WorldId& session, double x) {
  Anchor anchor;
  anchor.id = id;
  anchor.previous = previous;
  anchor.session = session;
  anchor.T_WA.p.x() = x;
  anchor.way_m = x;
  if (previous != 0) {
    anchor.from_previous = {{{12.0, 0.0, 0.0}, 0.0}, 0.01 * Eigen::Matrix4d::Identity()};
  }
  return anchor;
}

/// Two states with the same inputs. One is never marked as saved, so its changes are the whole
/// state.
class Pair {
 public:
  template <class Act>
  void both(const Act& act) {
    act(saving_);
    act(whole_);
  }
  void save() {
    apply(saving_.unsaved(), stored_);
    saving_.markSaved();
    EXPECT_TRUE(isEmpty(saving_.unsaved()));
    expectSame(stored_, whole_.unsaved().changed);
  }
  void see(TrackId id, AnchorId anchor, bool confirmed, double x) {
    seconds_ += 1.0;
    both([&](MapState& state) {
      const ObjectRecord* known = state.recordOfTrack(id);
      ObjectRecord record = known == nullptr ? ObjectRecord() : *known;
      record.confirmed = record.confirmed || confirmed;
      record.gone = false;
      record.last_seen = TimePoint(durationFromSeconds(seconds_));
      record.sighting.anchor = anchor;
      record.sighting.in_anchor.id = id;
      record.sighting.in_anchor.p.x() = x;
      state.put(id, std::move(record));
    });
  }
  MapState& saving() { return saving_; }
  const SavedMap& stored() const { return stored_; }

 private:
  double seconds_ = 0.0;
  MapState saving_{{}, {}}, whole_{{}, {}};
  SavedMap stored_;
};

TEST(MapState, ASeenObjectIsSavedOnceItIsConfirmed) {
  Pair pair;
  pair.both([](MapState& state) { state.add(anchorAt(1, 0, kOlder, 0.0)); });
  pair.see(7, 1, false, 1.0);
  pair.save();
  EXPECT_TRUE(pair.stored().records.empty());
  pair.see(7, 1, true, 2.0);
  pair.save();
  EXPECT_EQ(pair.stored().records.at(7).sighting.in_anchor.p.x(), 2.0);
  pair.both([](MapState& state) { state.erase(7); });
  pair.save();
  EXPECT_TRUE(pair.stored().records.empty());
}

TEST(MapState, AnObjectThatIsGoneAndBegunAgainUnconfirmedIsNoLongerStored) {
  Pair pair;
  pair.both([](MapState& state) { state.add(anchorAt(1, 0, kOlder, 0.0)); });
  pair.see(7, 1, true, 1.0);
  pair.save();
  pair.both([](MapState& state) { state.erase(7); });
  pair.see(7, 1, false, 5.0);
  pair.save();
  EXPECT_TRUE(pair.stored().records.empty());
  pair.see(7, 1, true, 6.0);
  pair.save();
  EXPECT_EQ(pair.stored().records.at(7).sighting.in_anchor.p.x(), 6.0);
}

TEST(MapState, AnObjectThatLosesItsConfirmedTrackIsNoLongerStored) {
  Pair pair;
  pair.both([](MapState& state) { state.add(anchorAt(1, 0, kOlder, 0.0)); });
  pair.see(7, 1, false, 1.0);
  pair.see(8, 1, true, 2.0);
  pair.both([](MapState& state) { state.unite({0, 7, 8}); });
  pair.save();
  EXPECT_TRUE(pair.stored().records.contains(7));
  pair.both([](MapState& state) { state.erase(8); });
  pair.save();
  EXPECT_TRUE(pair.stored().records.empty());
  EXPECT_EQ(keysOf(pair.stored().tracks), std::vector<TrackId>{7});
  pair.see(8, 1, true, 3.0);
  pair.save();
  EXPECT_TRUE(pair.stored().records.contains(7)) << "and it is there again";
}

TEST(MapState, WhatCameAndWentBetweenTwoSavesLeavesNothing) {
  Pair pair;
  pair.both([](MapState& state) {
    state.add(anchorAt(1, 0, kOlder, 0.0));
    state.add(anchorAt(2, 1, kOlder, 12.0));
  });
  pair.save();
  pair.see(7, 1, true, 1.0);
  pair.both([](MapState& state) {
    state.erase(7);
    state.erase(8);
    const EdgeId id = state.addLoop({1, 2, {{{12.1, 0.0, 0.0}, 0.0}, Eigen::Matrix4d::Identity()}});
    state.optimise();
    state.removeLoop(id);
  });
  pair.save();
  EXPECT_TRUE(pair.stored().records.empty());
  EXPECT_TRUE(pair.stored().edges.empty());
}

TEST(MapState, AnAnchorThatIsNoLongerTheFirstOneIsSavedThoughItStaysWhereItIs) {
  Pair pair;
  pair.both([](MapState& state) {
    state.add(anchorAt(1, 0, kOlder, 0.0));
    state.add(anchorAt(2, 0, kYounger, 0.0));
  });
  pair.save();
  EXPECT_TRUE(pair.stored().anchors.at(2).held_fast);
  pair.both([](MapState& state) {
    state.addLoop({1, 2, {{}, Eigen::Matrix4d::Identity()}});
    state.optimise();
  });
  pair.save();
}

/// Increments that had different factors have the same one afterwards, also in the graph.
TEST(MapState, AllIncrementsOfASessionHaveOneScale) {
  MapState state({}, {});
  const WorldId session{1, 0}, other{2, 0};
  for (AnchorId id = 1; id <= 4; ++id) {
    Anchor anchor = anchorAt(id, id - 1, id < 4 ? session : other, 12.0 * static_cast<double>(id));
    if (id == 4) anchor.previous = 0;
    if (id == 2) anchor.scale = {9.0, 4.0};
    anchor.from_previous.covariance = anchor.scale.of(Eigen::Matrix4d::Identity());
    state.add(anchor);
  }
  state.scaleOdometry({4.0, 0.25}, session);
  const Eigen::Matrix4d expected = Eigen::Vector4d(4.0, 4.0, 0.25, 4.0).asDiagonal();
  for (const AnchorId id : {2u, 3u}) {
    EXPECT_EQ(state.anchors().at(id).scale, (DriftVariance{4.0, 0.25}));
    EXPECT_LT((state.anchors().at(id).from_previous.covariance - expected).norm(), 1e-12);
  }
  EXPECT_EQ(state.anchors().at(4).scale, DriftVariance());
  std::size_t edges = 0;
  for (const auto& [id, edge] : state.graph().edges()) {
    EXPECT_LT((edge.T_ab.covariance - expected).norm(), 1e-12);
    ++edges;
  }
  EXPECT_EQ(edges, 2u);
}

TEST(MapState, AnyStepsLeaveWhatOneSaveWouldHaveWritten) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Pair pair;
    AnchorId last = 0;
    std::vector<EdgeId> loops;
    for (int step = 0; step < 150; ++step) {
      const auto any = random() % 100;
      if (any < 25 || last < 3) {
        const bool begins = last == 0 || random() % 9 == 0;
        const WorldId session{1 + last / 10, 0};
        pair.both([&](MapState& state) {
          state.add(
              anchorAt(last + 1, begins ? 0 : last, session, 12.0 * static_cast<double>(last)));
        });
        ++last;
      } else if (any < 50) {
        pair.see(1 + random() % 12, 1 + random() % last, random() % 3 == 0, normal(random));
      } else if (any < 57) {
        const TrackId id = 1 + random() % 12;
        pair.both([&](MapState& state) { state.erase(id); });
      } else if (any < 62) {
        const TrackId id = 1 + random() % 12;
        pair.both([&](MapState& state) { state.end(id); });
      } else if (any < 72) {
        const AnchorId a = 1 + random() % last, b = 1 + random() % last;
        if (a == b) continue;
        const LevelGaussian T_ab{
            {{3.0 * normal(random), normal(random), 0.0}, 0.1 * normal(random)},
            0.1 * Eigen::Matrix4d::Identity()};
        EdgeId id = 0;
        pair.both([&](MapState& state) { id = state.addLoop({a, b, T_ab, EdgeKind::kLoop}); });
        loops.push_back(id);
      } else if (any < 77 && !loops.empty()) {
        const EdgeId id = loops[random() % loops.size()];
        pair.both([&](MapState& state) { state.removeLoop(id); });
      } else if (any < 80) {
        const bool by_loop = !loops.empty() && random() % 3 > 0;
        const SameObject fact{by_loop ? loops[random() % loops.size()] : 0, 1 + random() % 12,
                              1 + random() % 12};
        pair.both([&](MapState& state) { state.unite(fact); });
      } else if (any < 83) {
        pair.both([](MapState& state) { state.optimise(); });
      } else if (any < 88) {
        const WorldId session{1 + random() % 3, 0};
        const DriftVariance scale{1.0 + static_cast<double>(random() % 4), 2.0};
        pair.both([&](MapState& state) { state.scaleOdometry(scale, session); });
      } else if (any < 92) {
        const std::string name = "class" + std::to_string(random() % 5);
        pair.both([&](MapState& state) { state.numberOf(name); });
      } else {
        pair.save();
      }
    }
    pair.save();
    // Another state continues from the stored one.
    MapState again({}, pair.stored());
    EXPECT_TRUE(isEmpty(again.unsaved())) << seed;
    ObjectRecord one_more =
        pair.stored().records.empty() ? ObjectRecord() : pair.stored().records.begin()->second;
    one_more.confirmed = true;
    again.put(1000, one_more);
    SavedMap longer = pair.stored();
    apply(again.unsaved(), longer);
    EXPECT_EQ(longer.records.size(), pair.stored().records.size() + 1) << seed;
    longer.records.erase(1000);
    expectSame(longer, pair.stored());
  }
}

Correction different(std::uint64_t id, ObjectId object, ObjectId other, bool withdrawn = false) {
  return {id, CorrectionKind::kDifferent, object, other, {}, 10.0, "me", {}, withdrawn};
}

TEST(MapState, ADeniedFactLeavesBothObjects) {
  Pair pair;
  pair.both([](MapState& state) { state.add(anchorAt(1, 0, kOlder, 0.0)); });
  pair.see(5, 1, true, 1.0);
  pair.see(9, 1, true, 2.0);
  pair.both([](MapState& state) { state.put(different(1, 5, 9)); });
  pair.save();
  pair.both([](MapState& state) { state.unite({7, 5, 9}); });
  pair.save();
  EXPECT_EQ(keysOf(pair.stored().records), (std::vector<ObjectId>{5, 9}));
}

TEST(MapState, ATrackThatADenialKeptAloneJoinsWhenTheOtherLeaves) {
  Pair pair;
  pair.both([](MapState& state) { state.add(anchorAt(1, 0, kOlder, 0.0)); });
  for (const TrackId track : {5, 9, 20}) pair.see(track, 1, true, 1.0 * static_cast<double>(track));
  pair.both([](MapState& state) {
    state.put(different(1, 9, 20));
    state.unite({7, 5, 9});
    state.unite({8, 5, 20});
  });
  pair.save();
  EXPECT_EQ(keysOf(pair.stored().records), (std::vector<ObjectId>{5, 20}));
  pair.both([](MapState& state) { state.put(different(2, 5, 9)); });
  pair.save();
  EXPECT_EQ(keysOf(pair.stored().records), (std::vector<ObjectId>{5, 9}));
  pair.both([](MapState& state) { state.put(different(2, 5, 9, true)); });
  pair.save();
  EXPECT_EQ(keysOf(pair.stored().records), (std::vector<ObjectId>{5, 20}));
}

TEST(MapState, NumbersOfClassesGoOnAfterARestart) {
  MapState state({}, {});
  EXPECT_EQ(state.numberOf("car"), 0u);
  EXPECT_EQ(state.numberOf("van"), 1u);
  MapState again({}, state.unsaved().changed);
  EXPECT_EQ(again.numberOf("person"), 2u);
  EXPECT_EQ(again.numberOf("van"), 1u);
  EXPECT_EQ(again.unsaved().changed.classes, (std::vector<std::string>{"car", "van", "person"}));
}

TEST(MapState, KnowsTheNewestAnchorOfEachSession) {
  MapState state({}, {});
  EXPECT_FALSE(state.newestOf(kOlder));
  state.add(anchorAt(1, 0, kOlder, 0.0));
  state.add(anchorAt(2, 0, kYounger, 0.0));
  state.add(anchorAt(3, 1, kOlder, 12.0));
  EXPECT_EQ(state.newestOf(kOlder)->id, 3u);
  EXPECT_EQ(state.newestOf(kYounger)->id, 2u);
  EXPECT_EQ(state.nextAnchor(), 4u);
}

}  // namespace
}  // namespace perdure::mapping

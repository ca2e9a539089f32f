// The row of an object is derived from its tracks. It follows the facts, and no row is lost.
#include "services/map_store/core/track_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>

#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using mapping::SameObject;
using test::carAt;
using test::workingSet;
using ::testing::ElementsAre;

struct ObjectRow {
  ObjectId id = 0;
  std::int64_t gone = 0, merged_into = 0, visibility = 0, memory = 0, places = 0;
  Bytes belief;
  bool operator==(const ObjectRow&) const = default;
};

/// A file, and the facts that a mapper would have; `commit` passes on their changes.
class Store {
 public:
  void join(const SameObject& fact) { identity_.add(fact); }
  void withdraw(mapping::EdgeId loop) { identity_.endLoop(loop); }
  void commit(std::vector<ObjectBelief> working, std::map<TrackId, Removal> removed = {}) {
    const Objects objects = workingSet(++commits_, std::move(working));
    for (auto& [id, removal] : removed) removal.time = objects.stamp.time;
    for (const ObjectBelief& belief : objects.objects) seen_.insert(belief.id);
    mapping::Unsaved facts;
    const auto& now = identity_.facts();
    const auto& before = stored_.facts();
    std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                        std::inserter(facts.changed.facts, facts.changed.facts.end()));
    std::set_difference(before.begin(), before.end(), now.begin(), now.end(),
                        std::inserter(facts.facts_gone, facts.facts_gone.end()));
    Batch batch{&objects, {}, std::move(removed)};
    batch.identity = &identity_;
    batch.facts = &facts;
    for (const TrackId id : seen_) {
      if (identity_.isShared(id) != stored_.isShared(id) ||
          identity_.objectOf(id) != stored_.objectOf(id)) {
        batch.regrouped.insert(id);
      }
    }
    const auto written = database_->write(batch);
    ASSERT_TRUE(written.has_value()) << written.error().detail;
    stored_ = identity_;
  }
  /// The next process, which starts from the file.
  void restart() {
    database_.reset();
    database_ = std::make_unique<MapDatabase>(StoreOptions{path_});
    EXPECT_EQ(reader().facts().value(), stored_.facts());
  }

  MapReader reader() const { return database_->reader(); }
  std::int64_t count(const std::string& table) const {
    return openStoreForReading(path_).integer("SELECT count(*) FROM " + table).value_or(-1);
  }
  std::vector<ObjectRow> rows() const {
    const auto connection = openStoreForReading(path_);
    auto row = connection
                   .prepare(
                       "SELECT o.id, o.gone, coalesce(o.merged_into, 0), o.visibility, o.memory, "
                       "(SELECT count(*) FROM positions p WHERE p.id = o.id), o.belief "
                       "FROM objects o ORDER BY o.id")
                   .value();
    std::vector<ObjectRow> all;
    while (row.step().value()) {
      const auto blob = row.blob(6);
      all.push_back({row.id(0), row.integer(1), row.integer(2), row.integer(3), row.integer(4),
                     row.integer(5), Bytes(blob.begin(), blob.end())});
    }
    return all;
  }
  ObjectRow row(ObjectId id) const {
    const auto all = rows();
    const auto at = std::find_if(all.begin(), all.end(), [id](auto& r) { return r.id == id; });
    return at == all.end() ? ObjectRow{} : *at;
  }
  std::vector<ObjectId> onTheMap() const {
    std::vector<ObjectId> ids;
    const auto all = reader().beliefs().value();
    for (const PlacedBelief& placed : all) ids.push_back(placed.belief.id);
    return ids;
  }

 private:
  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("map.sqlite");
  std::unique_ptr<MapDatabase> database_ = std::make_unique<MapDatabase>(StoreOptions{path_});
  mapping::Identity identity_, stored_;
  std::set<TrackId> seen_;
  std::uint64_t commits_ = 30;
};

constexpr std::int64_t kGone = 1 + static_cast<std::int64_t>(EventKind::kGone);
constexpr std::int64_t kMerged = 1 + static_cast<std::int64_t>(EventKind::kMerged);
constexpr std::int64_t kWorking = static_cast<std::int64_t>(Memory::kWorking);
constexpr std::int64_t kLongTerm = static_cast<std::int64_t>(Memory::kLongTerm);

ObjectBelief seen(TrackId id, double x, int seconds = 0) {
  ObjectBelief belief = carAt(id, {x, 2, 0});
  belief.last_seen += std::chrono::seconds(seconds);
  belief.as_of = belief.last_seen;
  return belief;
}

Bytes bytesOf(ObjectBelief belief, ObjectId as) {
  belief.id = as;
  return encodeBelief(belief);
}

/// Track 3 was detected on an earlier visit; 9 is in the working set; loop closure 7 shows that
/// they are one object.
class TrackRows : public ::testing::Test {
 protected:
  TrackRows() {
    store_.commit({old_});
    store_.commit({});
    store_.commit({new_});
    before_ = store_.rows();
  }
  void join() {
    store_.join({7, 3, 9});
    store_.commit({new_});
  }
  static Removal gone() { return {EventKind::kGone, {}, 0}; }

  const ObjectBelief old_ = seen(3, 1.0), new_ = seen(9, 8.0, 5);
  Store store_;
  std::vector<ObjectRow> before_;
};

TEST_F(TrackRows, AFactShowsOneObjectUnderTheLowerIdWithTheNewerTracksBelief) {
  join();
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  const ObjectRow object = store_.row(3), other = store_.row(9);
  EXPECT_EQ(object.belief, bytesOf(new_, 3));
  EXPECT_EQ(object.gone, 0);
  EXPECT_EQ(object.places, 1);
  EXPECT_EQ(object.memory, kWorking);
  EXPECT_EQ(other.gone, kMerged);
  EXPECT_EQ(other.merged_into, 3);
  EXPECT_EQ(other.places, 0);
  EXPECT_EQ(other.belief, encodeBelief(new_));
  EXPECT_THAT(store_.reader().mergedInto(3).value(), ElementsAre(9u));
  EXPECT_FALSE(store_.reader().placeOf(9).value());
  EXPECT_EQ(store_.reader().facts().value(), (std::set<SameObject>{{7, 3, 9}}));
}

TEST_F(TrackRows, EachTrackKeepsItsOwnBelief) {
  join();
  EXPECT_EQ(encodeBelief(store_.reader().beliefOf(3).value()->belief), encodeBelief(old_));
  EXPECT_EQ(encodeBelief(store_.reader().beliefOf(9).value()->belief), encodeBelief(new_));
  const auto working = store_.reader().working().value();
  ASSERT_EQ(working->objects.size(), 1u);
  EXPECT_EQ(encodeBelief(working->objects[0]), encodeBelief(new_)) << "the filter's own track";
}

TEST_F(TrackRows, AnObjectWhoseTracksLeaveTheWorkingSetIsLongTerm) {
  join();
  store_.commit({});
  EXPECT_EQ(store_.row(3).memory, kLongTerm);
  EXPECT_EQ(store_.row(3).belief, bytesOf(new_, 3)) << "of the track that was detected last";
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
}

TEST_F(TrackRows, WhenTheFactEndsBothRowsAreAsTheyWereToTheByte) {
  join();
  store_.withdraw(7);
  store_.commit({new_});
  EXPECT_TRUE(store_.rows() == before_);
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u, 9u));
  EXPECT_EQ(store_.count("tracks"), 0);
  EXPECT_EQ(store_.count("same"), 0);
}

TEST_F(TrackRows, TheSameHoldsIfProcessesBeginAndEndInBetween) {
  store_.restart();
  join();
  store_.restart();
  store_.commit({new_});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  store_.restart();
  store_.withdraw(7);
  store_.commit({new_});
  store_.restart();
  EXPECT_TRUE(store_.rows() == before_);
}

TEST_F(TrackRows, WhatWasSeenSinceIsOfTheTrackThatSawIt) {
  join();
  const ObjectBelief later = seen(9, 8.1, 6);
  store_.commit({later});
  EXPECT_EQ(store_.row(3).belief, bytesOf(later, 3));
  store_.commit({});
  store_.withdraw(7);
  store_.commit({});
  EXPECT_TRUE(store_.row(3) == before_[0]);
  EXPECT_EQ(store_.row(9).belief, encodeBelief(later));
  EXPECT_EQ(store_.row(9).memory, kLongTerm);
}

TEST_F(TrackRows, ATrackThatIsSeenAgainIsTheNewest) {
  join();
  const ObjectBelief again = seen(3, 1.1, 20);
  store_.commit({again});
  EXPECT_EQ(store_.row(3).belief, encodeBelief(again));
  store_.withdraw(7);
  store_.commit({again});
  EXPECT_EQ(store_.row(3).belief, encodeBelief(again));
  EXPECT_EQ(store_.row(9).belief, encodeBelief(new_));
  EXPECT_EQ(store_.row(9).memory, kLongTerm);
}

TEST_F(TrackRows, AnOlderTrackThatIsGoneEndsNotItsObjectButItsOwnRowAfterwards) {
  join();
  store_.commit({new_}, {{3, gone()}});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  EXPECT_EQ(store_.row(3).belief, bytesOf(new_, 3));
  EXPECT_FALSE(store_.reader().beliefOf(3).value());
  store_.withdraw(7);
  store_.commit({new_});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(9u));
  EXPECT_EQ(store_.row(3).gone, kGone);
  EXPECT_EQ(store_.row(3).belief, encodeBelief(old_));
  EXPECT_EQ(store_.row(3).places, 0);
}

TEST_F(TrackRows, TheNewestTrackThatIsGoneEndsItsObjectButOnlyItsOwnRowAfterwards) {
  join();
  store_.commit({}, {{9, gone()}});
  EXPECT_TRUE(store_.onTheMap().empty());
  EXPECT_EQ(store_.row(3).gone, kGone);
  EXPECT_EQ(store_.row(3).places, 0);
  store_.restart();
  store_.withdraw(7);
  store_.commit({});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  EXPECT_TRUE(store_.row(3) == before_[0]);
  EXPECT_EQ(store_.row(9).gone, kGone);
  EXPECT_EQ(store_.row(9).belief, encodeBelief(new_));
}

TEST_F(TrackRows, AnObjectThatWasGoneIsBackWhenATrackOfItIsSeen) {
  join();
  store_.commit({}, {{9, gone()}});
  const ObjectBelief again = seen(3, 1.1, 20);
  store_.commit({again});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  EXPECT_EQ(store_.row(3).belief, encodeBelief(again));
}

TEST_F(TrackRows, ATrackThatTheFilterMergedIsInTheOtherOneForGood) {
  store_.join({0, 3, 9});
  const ObjectBelief merged = seen(3, 5.0, 6);
  store_.commit({merged}, {{9, {EventKind::kMerged, {}, 3}}});
  EXPECT_THAT(store_.onTheMap(), ElementsAre(3u));
  EXPECT_EQ(store_.row(3).belief, encodeBelief(merged));
  EXPECT_EQ(store_.row(9).merged_into, 3);
  EXPECT_EQ(store_.count("tracks"), 1);
  store_.withdraw(7);
  store_.commit({merged});
  EXPECT_EQ(store_.row(9).gone, kMerged);
}

TEST(TrackRowsInAnyOrder, FactsGiveTheSameRows) {
  // Tracks 1 … 5 are archived, 6 and 7 are in the working set; 8 shares no object.
  const std::vector<SameObject> facts = {{20, 1, 4}, {21, 4, 6}, {0, 2, 3}, {22, 2, 5}, {23, 3, 7}};
  const auto driven = [] {
    auto store = std::make_unique<Store>();
    for (TrackId id = 1; id <= 5; ++id) store->commit({seen(id, static_cast<double>(id))});
    store->commit({seen(6, 6, 9), seen(7, 7, 9), seen(8, 8, 9)});
    return store;
  };
  const std::vector<ObjectBelief> working{seen(6, 6, 9), seen(7, 7, 9), seen(8, 8, 9)};
  const auto at_once = driven();
  for (const SameObject& fact : facts) at_once->join(fact);
  at_once->commit(working);
  EXPECT_THAT(at_once->onTheMap(), ElementsAre(1u, 2u, 8u));
  EXPECT_EQ(at_once->row(1).belief, bytesOf(working[0], 1));
  EXPECT_EQ(at_once->row(2).belief, bytesOf(working[1], 2));
  std::vector<std::size_t> order = {0, 1, 2, 3, 4};
  int orders = 0;
  do {
    if (++orders % 7 != 0) continue;
    const auto store = driven();
    for (const std::size_t k : order) {
      store->join(facts[k]);
      store->commit(working);
    }
    EXPECT_TRUE(store->rows() == at_once->rows()) << ::testing::PrintToString(order);
    // The facts end in the reverse order, but those from the filter remain.
    for (const std::size_t k : order) {
      if (facts[k].loop == 0) continue;
      store->withdraw(facts[k].loop);
      store->commit(working);
    }
    EXPECT_THAT(store->onTheMap(), ElementsAre(1u, 2u, 4u, 5u, 6u, 7u, 8u));
    EXPECT_EQ(store->row(4).belief, encodeBelief(seen(4, 4.0)));
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(TrackRowsInAnyOrder, TwoTracksOfOneObjectInViewShowTheOneThatWasDetectedLast) {
  const ObjectBelief one = seen(5, 5, 9), other = seen(6, 6, 7);
  for (const bool swapped : {false, true}) {
    Store store;
    store.commit({seen(1, 1)});
    store.commit({one, other});
    store.join({20, 1, swapped ? 6u : 5u});
    store.commit({one, other});
    store.join({21, 1, swapped ? 5u : 6u});
    store.commit({one, other});
    EXPECT_THAT(store.onTheMap(), ElementsAre(1u));
    EXPECT_EQ(store.row(1).belief, bytesOf(one, 1));
  }
}

}  // namespace
}  // namespace perdure::map_store

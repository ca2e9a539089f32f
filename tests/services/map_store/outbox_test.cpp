#include "services/map_store/core/outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

using test::carAt;
using test::workingSet;

struct Entry {
  std::int64_t number = 0, table = 0, id = 0;
};

std::vector<Entry> entriesOf(const std::string& path) {
  const auto connection = Connection::open(path, Connection::Mode::kReadOnly).value();
  auto rows = connection.prepare("SELECT number, tbl, id FROM outbox ORDER BY number").value();
  std::vector<Entry> entries;
  while (rows.step().value()) {
    entries.push_back({rows.integer(0), rows.integer(1), rows.integer(2)});
  }
  return entries;
}

/// Ids of one table, in the order of their change numbers.
std::vector<std::int64_t> idsOf(const std::string& path, OutboxTable table) {
  std::vector<std::int64_t> ids;
  for (const Entry& entry : entriesOf(path)) {
    if (entry.table == static_cast<std::int64_t>(table)) ids.push_back(entry.id);
  }
  return ids;
}

OutboxMark markOf(const std::string& path) {
  return outboxMark(Connection::open(path, Connection::Mode::kReadOnly).value()).value();
}

void commit(MapDatabase& database, const Objects& objects, std::int64_t acknowledged = 0) {
  Batch batch{&objects, {}, {}};
  batch.acknowledged = acknowledged;
  ASSERT_TRUE(database.write(batch).has_value());
}

class Outbox : public ::testing::Test {
 protected:
  const test::TemporaryFolder folder_;
  const std::string path_ = folder_.file("map.sqlite");
};

TEST_F(Outbox, NamesEachRowThatChangedOnceByItsLastChange) {
  MapDatabase database({.path = path_, .outbox = true});
  commit(database, workingSet(1, {carAt(1, {1, 0, 0}), carAt(2, {2, 0, 0}), carAt(3, {3, 0, 0})}));
  commit(database, workingSet(2, {carAt(1, {9, 0, 0}), carAt(2, {2, 0, 0}), carAt(3, {3, 0, 0})}));
  EXPECT_THAT(idsOf(path_, OutboxTable::kObjects), ::testing::ElementsAre(2, 3, 1));
  EXPECT_THAT(idsOf(path_, OutboxTable::kWorking), ::testing::ElementsAre(0));
}

TEST_F(Outbox, NamesWhatLeavesIsRemovedOrDeleted) {
  MapDatabase database({.path = path_, .outbox = true});
  mapping::Unsaved graph{test::RandomGraph(4).map({}), {}, {}};
  Objects objects = workingSet(1, {carAt(1, {1, 0, 0}), carAt(2, {2, 0, 0})});
  Batch batch{&objects, {}, {}};
  batch.graph = &graph;
  ASSERT_TRUE(database.write(batch).has_value());
  EXPECT_EQ(idsOf(path_, OutboxTable::kAnchors).size(), 40u);
  EXPECT_EQ(idsOf(path_, OutboxTable::kPoses).size(), 40u);
  EXPECT_EQ(idsOf(path_, OutboxTable::kEdges).size(), 60u);
  EXPECT_EQ(idsOf(path_, OutboxTable::kSightings).size(), 100u);
  EXPECT_EQ(idsOf(path_, OutboxTable::kClasses).size(), 3u);

  graph.edges_gone = {60};
  graph.changed = {};
  objects = workingSet(2, {carAt(2, {2, 0, 0})});
  batch.removed[2] = {EventKind::kGone, fromNanoseconds(900'000'000), 0};
  batch.acknowledged = markOf(path_).last;
  ASSERT_TRUE(database.write(batch).has_value());
  EXPECT_THAT(idsOf(path_, OutboxTable::kEdges), ::testing::ElementsAre(60));
  EXPECT_THAT(idsOf(path_, OutboxTable::kObjects), ::testing::UnorderedElementsAre(1, 2));
  EXPECT_THAT(idsOf(path_, OutboxTable::kSightings), ::testing::ElementsAre(2));
}

TEST_F(Outbox, GivesNoNumberTwice) {
  std::int64_t last = 0;
  OutboxMark first;
  for (int round = 0; round < 3; ++round) {
    MapDatabase database({.path = path_, .outbox = true});
    if (round == 0) first = markOf(path_);
    EXPECT_EQ(markOf(path_).file, first.file);
    EXPECT_EQ(markOf(path_).outbox, first.outbox);
    const auto sequence = static_cast<std::uint64_t>(1 + round);
    commit(database, workingSet(sequence, {carAt(sequence, {1, 0, 0})}), last);
    for (const Entry& entry : entriesOf(path_)) EXPECT_GT(entry.number, last);
    last = markOf(path_).last;
    EXPECT_GT(last, markOf(path_).acknowledged);
  }
}

TEST_F(Outbox, AFileWithoutServerHasNothingOfIt) {
  const auto made = [&](const std::string& path) {
    const auto connection = Connection::open(path, Connection::Mode::kReadOnly).value();
    return std::pair(
        connection.integer("SELECT count(*) FROM sqlite_master").value(),
        connection.integer("SELECT count(*) FROM sqlite_master WHERE type = 'trigger'").value());
  };
  const std::string other = folder_.file("other.sqlite");
  { const MapDatabase never({.path = path_}); }
  { const MapDatabase for_a_while({.path = other, .outbox = true}); }
  EXPECT_GT(made(other).second, 0);
  { const MapDatabase no_longer({.path = other}); }
  EXPECT_EQ(made(path_).second, 0);
  EXPECT_EQ(made(other).second, 0);
  EXPECT_LE(made(other).first, made(path_).first + 1);  // sqlite_sequence remains
}

TEST_F(Outbox, IsAnotherOneAfterATimeWithoutServer) {
  { const MapDatabase database({.path = path_, .outbox = true}); }
  const OutboxMark before = markOf(path_);
  {
    MapDatabase database({.path = path_});
    commit(database, workingSet(1, {carAt(1, {1, 0, 0})}));
    const auto connection = Connection::open(path_, Connection::Mode::kReadOnly).value();
    EXPECT_EQ(outboxMark(connection).error().code, "no_outbox");
  }
  { const MapDatabase database({.path = path_, .outbox = true}); }
  EXPECT_EQ(markOf(path_).file, before.file);
  EXPECT_NE(markOf(path_).outbox, before.outbox);
}

TEST_F(Outbox, OneThatDoesNotFollowEveryTableIsBegunAnew) {
  { const MapDatabase database({.path = path_, .outbox = true}); }
  const OutboxMark before = markOf(path_);
  {
    const auto connection = Connection::open(path_, Connection::Mode::kReadWriteCreate).value();
    ASSERT_TRUE(connection.execute("DROP TRIGGER outbox_views_INSERT").has_value());
  }
  { const MapDatabase database({.path = path_, .outbox = true}); }
  EXPECT_NE(markOf(path_).outbox, before.outbox);
  { const MapDatabase again({.path = path_, .outbox = true}); }
  EXPECT_EQ(markOf(path_).file, before.file);
}

}  // namespace
}  // namespace perdure::map_store

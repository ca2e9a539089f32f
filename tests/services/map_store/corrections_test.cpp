// Corrections of people: their effect on the published map, and that a withdrawn one leaves no
// trace.
#include "tests/support/corrections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/map_store/core/track_rows.h"
#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using namespace std::chrono_literals;
using namespace perdure::test;  // NOLINT(google-build-using-namespace)
using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr auto kPerson = static_cast<std::size_t>(ExistenceEvidence::kPerson);
constexpr auto kPersonClass = static_cast<std::size_t>(ClassEvidence::kPerson);

class CorrectedMap : public ::testing::Test {
 protected:
  CorrectedMap() {
    config_.store_path = folder_.file("map.sqlite");
    config_.graph = false;
    start();
    node_->onObjects(
        workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {9, 0, 0}), carAt(3, {20, 0, 0})}));
    node_->flush();
  }
  void start() {
    node_.reset();
    node_ = std::make_unique<Node>(config_, 5,
                                   Outputs{.tile =
                                               [this](const MapTile& t) {
                                                 tiles_[{t.x, t.y}] = t;
                                               },
                                           .emptied =
                                               [this](const MapTile& t) {
                                                 tiles_.erase({t.x, t.y});
                                               },
                                           .header = [](const MapHeader&) {},
                                           .reply = [this](const MapReply& r) { reply_ = r; },
                                           .near = [this](const MapNear& n) { near_ = n; }});
  }
  const MapReply& send(const Correction& correction) {
    node_->onCorrection({3, ++request_, correction});
    node_->flush();
    return reply_;
  }
  const MapReply& withdraw(std::uint64_t id) { return send(withdrawal(id)); }
  const MapReply& ask(MapQueryKind kind, ObjectId id = 0, const std::string& name = "") {
    MapQuery query;
    query.client = 3;
    query.request = ++request_;
    query.kind = kind;
    query.object_id = id;
    query.class_name = name;
    node_->onQuery(query);
    return reply_;
  }
  ObjectBelief belief(ObjectId id) {
    const MapReply& reply = ask(MapQueryKind::kById, id);
    return reply.beliefs.empty() ? ObjectBelief{} : reply.beliefs.front();
  }
  std::vector<ObjectId> ids(MapQueryKind kind = MapQueryKind::kAll, const std::string& name = "") {
    std::vector<ObjectId> result;
    for (const MapObject& object : ask(kind, 0, name).objects) result.push_back(object.id);
    return result;
  }
  /// All columns of the stored objects, of which `gone_ns` may change.
  std::string stored() const {
    const Connection file = openStoreForReading(config_.store_path);
    std::string all;
    EXPECT_TRUE(file.forRows("SELECT quote(id) || quote(class) || quote(existence) || quote(gone) "
                             "|| quote(visibility) || quote(merged_into) || hex(belief) "
                             "FROM objects ORDER BY id",
                             [&](const Statement& row) { all += row.text(0) + "\n"; })
                    .has_value());
    return all;
  }
  /// What the map publishes: tiles and full beliefs.
  std::string published() {
    std::string all;
    for (const auto& [square, tile] : tiles_) {
      for (const MapObject& o : tile.objects) {
        all += std::to_string(o.id) + o.class_name;
        all.append(reinterpret_cast<const char*>(&o.existence), sizeof o.existence);
        all.append(reinterpret_cast<const char*>(&o.class_probability), sizeof(double));
      }
    }
    for (const ObjectId id : ids()) {
      const Bytes bytes = encodeBelief(belief(id));
      all.append(bytes.begin(), bytes.end());
    }
    return all;
  }

  TemporaryFolder folder_;
  Config config_;
  std::unique_ptr<Node> node_;
  std::map<std::pair<int, int>, MapTile> tiles_;
  MapReply reply_;
  MapNear near_;
  std::uint64_t request_ = 0;
};

TEST_F(CorrectedMap, NotThereLowersTheExistenceByItsNats) {
  const double before = logOdds(belief(1).existence);
  const std::string stored_before = stored();
  ASSERT_TRUE(send(notThere(1, 4.0, "Ada")).ok) << reply_.error;
  const ObjectBelief after = belief(1);
  EXPECT_NEAR(logOdds(after.existence), before - 4.0, 1e-9);
  EXPECT_NEAR(after.why.logOdds(), before - 4.0, 1e-9);
  EXPECT_EQ(after.why.existence.at(kPerson).log_odds, -4.0);
  EXPECT_FALSE(after.confirmed);
  ASSERT_THAT(ask(MapQueryKind::kById, 1).corrections, SizeIs(1));
  EXPECT_EQ(reply_.corrections[0].author, "Ada");
  EXPECT_THAT(ask(MapQueryKind::kById, 2).corrections, IsEmpty());
  EXPECT_EQ((tiles_.at({0, 0}).objects.at(0).existence), after.existence);
  ASSERT_THAT(near_.corrections, SizeIs(1));
  EXPECT_EQ(stored(), stored_before);
}

TEST_F(CorrectedMap, TheDefaultOutweighsTheFiltersLargestExistence) {
  ObjectBelief certain = carAt(1, {0, 0, 0});
  certain.existence = 0.999;
  node_->onObjects(workingSet(2, {certain, carAt(2, {9, 0, 0}), carAt(3, {20, 0, 0})}));
  EXPECT_EQ(send(notThere(1)).corrections.at(0).nats, 10.0);
  EXPECT_LT(belief(1).existence, 0.05);
}

TEST_F(CorrectedMap, TheRightClassBecomesTheMostProbableOne) {
  EXPECT_FALSE(send(rightClass(1, "vam")).ok);
  EXPECT_THAT(reply_.error, HasSubstr("'vam'; its classes are: car"));
  ObjectBelief van = carAt(2, {9, 0, 0}, "van");
  node_->onObjects(workingSet(2, {carAt(1, {0, 0, 0}), van, carAt(3, {20, 0, 0})}));
  node_->flush();
  ASSERT_TRUE(send(rightClass(1, "van")).ok) << reply_.error;
  const ObjectBelief after = belief(1);
  EXPECT_EQ(after.best().name, "van");  // the belief did not contain this class
  EXPECT_GT(after.best().probability, 0.95);
  double sum = 0.0;
  for (const ClassBelief& each : after.classes) {
    sum += each.probability;
    const auto row = std::ranges::find(after.why.classes, each.name, &ClassLedger::name);
    ASSERT_NE(row, after.why.classes.end());
    double nats = 0.0;
    for (const double n : row->log_odds) nats += n;
    EXPECT_NEAR(nats, std::log(each.probability), 1e-9) << each.name;
    EXPECT_NE(row->log_odds.at(kPersonClass), 0.0);
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_THAT(ids(MapQueryKind::kByClass, "van"), ElementsAre(1u, 2u));
  EXPECT_THAT(ids(MapQueryKind::kByClass, "car"), ElementsAre(3u));
}

TEST_F(CorrectedMap, SameObjectsAreOneWithTheNewerBelief) {
  ASSERT_TRUE(send(ofTwo(CorrectionKind::kSame, 3, 1)).ok) << reply_.error;
  EXPECT_THAT(ids(), ElementsAre(1u, 2u));
  EXPECT_EQ(belief(1).last_seen, carAt(3, {}).last_seen);
  // The filter must not fuse the tracks, because the correction may be withdrawn.
  EXPECT_THAT(near_.members, IsEmpty());
  ASSERT_THAT(near_.corrections, SizeIs(1));
  EXPECT_EQ(near_.corrections[0].object + near_.corrections[0].other, 4u);
}

TEST_F(CorrectedMap, AQueryByTheIdOfAJoinedObjectFindsTheOther) {
  ASSERT_TRUE(send(ofTwo(CorrectionKind::kSame, 1, 2)).ok);
  const MapReply& reply = ask(MapQueryKind::kById, 2);
  ASSERT_THAT(reply.objects, SizeIs(1));
  EXPECT_EQ(reply.objects[0].id, 1u);
  EXPECT_THAT(reply.corrections, SizeIs(1));
}

TEST_F(CorrectedMap, CorrectionsThatCannotBeReadAreReported) {
  ASSERT_TRUE(send(notThere(1)).ok);
  node_.reset();
  ASSERT_TRUE(Connection::open(config_.store_path, Connection::Mode::kReadWriteCreate)
                  .and_then([](const Connection& file) {
                    return file.execute("ALTER TABLE corrections RENAME COLUMN nats TO bits");
                  })
                  .has_value());
  start();
  EXPECT_THAT(node_->trouble(), HasSubstr("no such column: nats"));
}

TEST_F(CorrectedMap, DifferentSeparatesWhatALoopJoinedUnlessItsEvidenceIsWeaker) {
  node_.reset();
  {
    MapDatabase database({config_.store_path});
    const Objects working = workingSet(2, {carAt(1, {0, 0, 0}), carAt(2, {9, 0, 0})});
    const mapping::Identity joined({{7, 1, 2}});
    mapping::Unsaved facts;
    facts.changed.facts = joined.facts();
    Batch batch{&working, {}, {}};
    batch.identity = &joined;
    batch.facts = &facts;
    batch.regrouped = {1, 2};
    ASSERT_TRUE(database.write(batch).has_value());
  }
  start();
  node_->onObjects(workingSet(3, {carAt(1, {0, 0, 0}), carAt(2, {9, 0, 0})}));
  node_->flush();
  const std::string before = stored(), seen = published();
  EXPECT_THAT(ids(), ElementsAre(1u, 3u));
  Correction apart = ofTwo(CorrectionKind::kDifferent, 1, 2, 5.0);
  ASSERT_TRUE(send(apart).ok) << reply_.error;
  EXPECT_THAT(ids(), ElementsAre(1u, 3u));
  apart.nats = 0.0;
  ASSERT_TRUE(send(apart).ok) << reply_.error;
  EXPECT_THAT(ids(), ElementsAre(1u, 2u, 3u));
  start();
  EXPECT_THAT(ids(), ElementsAre(1u, 2u, 3u));
  ASSERT_TRUE(withdraw(2).ok) << reply_.error;
  ASSERT_TRUE(withdraw(1).ok) << reply_.error;
  EXPECT_EQ(stored(), before);
  EXPECT_EQ(published(), seen);
}

TEST_F(CorrectedMap, AWithdrawnCorrectionLeavesTheBytesOfBefore) {
  const std::string before = stored(), seen = published();
  const std::vector<Correction> kinds{notThere(1), rightClass(1, "car", 3.0),
                                      ofTwo(CorrectionKind::kSame, 1, 2),
                                      ofTwo(CorrectionKind::kDifferent, 1, 3)};
  for (const Correction& each : kinds) {
    ASSERT_TRUE(send(each).ok) << reply_.error;
    const bool has_effect = each.kind != CorrectionKind::kDifferent;
    EXPECT_EQ(published() != seen, has_effect) << nameOf(each.kind);
    start();  // it stands after a restart
    node_->flush();
    EXPECT_EQ(published() != seen, has_effect) << nameOf(each.kind);
    const auto standing = ask(MapQueryKind::kAll).corrections;
    ASSERT_THAT(standing, SizeIs(1));
    ASSERT_TRUE(withdraw(standing[0].id).ok) << reply_.error;
    EXPECT_EQ(stored(), before) << nameOf(each.kind);
    EXPECT_EQ(published(), seen) << nameOf(each.kind);
    EXPECT_THAT(ask(MapQueryKind::kAll).corrections, IsEmpty());
  }
}

TEST_F(CorrectedMap, RefusesWhatItCannotUseAndNamesTheCause) {
  const std::string before = stored();
  EXPECT_THAT(send(notThere(77)).error, HasSubstr("no object 77; `perdure map list`"));
  EXPECT_THAT(send(ofTwo(CorrectionKind::kSame, 1, 1)).error, HasSubstr("object 1 is given twice"));
  EXPECT_THAT(send(ofTwo(CorrectionKind::kSame, 1, 78)).error, HasSubstr("no object 78"));
  EXPECT_THAT(withdraw(4).error, HasSubstr("no correction 4 stands"));
  EXPECT_FALSE(reply_.ok);
  EXPECT_EQ(node_->reasons().of("correction_refused"), 4u);
  EXPECT_EQ(stored(), before);
}

TEST_F(CorrectedMap, AMergeByTheFilterIsFinal) {
  Objects merged = workingSet(2, {carAt(1, {0, 0, 0}), carAt(3, {20, 0, 0})});
  merged.ended = {{2, 1, merged.stamp.time}};
  node_->onObjects(merged);
  EXPECT_THAT(send(ofTwo(CorrectionKind::kDifferent, 1, 2)).error,
              HasSubstr("merged 1 and 2 into one track"));
}

TEST_F(CorrectedMap, ARepeatedRequestIsOneCorrection) {
  node_->onCorrection({4, 1, notThere(1)});
  node_->onCorrection({4, 1, notThere(1)});
  EXPECT_TRUE(reply_.ok);
  EXPECT_THAT(ask(MapQueryKind::kAll).corrections, SizeIs(1));
}

TEST_F(CorrectedMap, AStatementThatIsMadeAgainCountsOnce) {
  ASSERT_TRUE(send(notThere(1)).ok);
  const double existence = belief(1).existence;
  ASSERT_TRUE(send(notThere(1)).ok) << reply_.error;
  EXPECT_EQ(reply_.corrections.at(0).id, 1u);
  EXPECT_EQ(belief(1).existence, existence);
  Correction by_another = notThere(1);
  by_another.author = "another";
  ASSERT_TRUE(send(by_another).ok) << reply_.error;
  EXPECT_LT(belief(1).existence, existence);
}

TEST_F(CorrectedMap, TheFilterDoesNotJoinWhatTheMapKeepsApart) {
  ASSERT_TRUE(send(ofTwo(CorrectionKind::kSame, 3, 1)).ok) << reply_.error;
  ASSERT_TRUE(send(ofTwo(CorrectionKind::kDifferent, 1, 3, 20.0)).ok) << reply_.error;
  EXPECT_THAT(ids(), ElementsAre(1u, 2u, 3u));
  EXPECT_THAT(near_.corrections, IsEmpty());
}

TEST_F(CorrectedMap, StoresTheFiltersOwnBelief) {
  ObjectBelief own = carAt(1, {0, 0, 0}), shown = own;
  shown.existence = 0.01;
  Objects objects = workingSet(2, {shown, carAt(2, {9, 0, 0}), carAt(3, {20, 0, 0})});
  objects.as_estimated = {own};
  const std::string before = stored();
  node_->onObjects(objects);
  node_->flush();
  EXPECT_EQ(stored(), before);
}

}  // namespace
}  // namespace perdure::map_store

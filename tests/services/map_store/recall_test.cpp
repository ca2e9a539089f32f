// What the map store gives back of its long-term memory, and when it says that it has something.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using namespace std::chrono_literals;
using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Recall : public ::testing::Test {
 protected:
  Recall() { config_.store_path = folder_.file("map.sqlite"); }

  std::unique_ptr<Node> start() {
    return std::make_unique<Node>(
        config_, 5,
        Outputs{[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
                [this](const MapReply& r) { replies_.push_back(r); },
                [this](const Recalled& r) { recalled_.push_back(r); }});
  }
  static MapQuery near(const Eigen::Vector3d& centre, double radius, InstanceId client = 11,
                       std::uint64_t request = 1) {
    MapQuery query;
    query.client = client;
    query.request = request;
    query.kind = MapQueryKind::kRecall;
    query.low = centre;
    query.radius = radius;
    query.world = {77, 1};
    return query;
  }
  std::vector<ObjectId> ids() const {
    std::vector<ObjectId> ids;
    for (const auto& o : recalled_.back().objects) ids.push_back(o.id);
    return ids;
  }

  TemporaryFolder folder_;
  Config config_;
  std::vector<MapReply> replies_;
  std::vector<Recalled> recalled_;
};

TEST_F(Recall, GivesWhatIsNearAndInNoWorkingSetNearestFirstBitForBit) {
  const auto node = start();
  const auto far = carAt(3, {90, 0, 0}), nearer = carAt(4, {40, 0, 0}),
             there = carAt(5, {41, 0, 0});
  node->onObjects(workingSet(1, {far, nearer, there, carAt(6, {200, 0, 0})}));
  node->onObjects(workingSet(2, {there}));
  node->onQuery(near({0, 0, 0}, 100, 11, 8));
  ASSERT_THAT(ids(), ElementsAre(4u, 3u));
  const Recalled& answer = recalled_.back();
  EXPECT_FALSE(answer.restore);
  EXPECT_FALSE(answer.truncated);
  EXPECT_EQ(answer.client, 11u);
  EXPECT_EQ(answer.request, 8u);
  EXPECT_EQ(answer.world, (WorldId{77, 1}));
  ObjectBelief expected = nearer;  // but for where it was kept meanwhile
  expected.memory = Memory::kLongTerm;
  expected.visibility = Visibility::kOutOfView;
  EXPECT_EQ(encodeBelief(answer.objects[0]), encodeBelief(expected));
}

TEST_F(Recall, AThingThatIsBackInTheWorkingSetIsNotGivenAgain) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(3, {9, 0, 0})}));
  node->onObjects(workingSet(2, {}));
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_THAT(ids(), ElementsAre(3u));
  node->onObjects(workingSet(3, {carAt(3, {9, 0, 0})}));
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(Recall, WhatIsGoneOrOfAnotherFrameOfReferenceStaysAway) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(3, {9, 0, 0}), carAt(4, {8, 0, 0})}));
  Event gone;
  gone.kind = EventKind::kGone;
  gone.object_id = 3;
  gone.stamp.time = fromNanoseconds(200'000'000);
  node->onObjects(workingSet(2, {}));
  node->onEvent(gone);
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_THAT(ids(), ElementsAre(4u));
  MapQuery elsewhere = near({0, 0, 0}, 100);
  elsewhere.world = {77, 2};
  node->onQuery(elsewhere);
  EXPECT_THAT(ids(), IsEmpty());
}

TEST_F(Recall, OneThatWasNoLongerConfirmedWhenItLeftIsKeptAsItWasBefore) {
  const auto node = start();
  const auto sure = carAt(3, {9, 0, 0});
  node->onObjects(workingSet(1, {sure}));
  node->tick(0ms);
  auto doubtful = sure;
  doubtful.confirmed = false;
  doubtful.existence = 0.6;
  node->onObjects(workingSet(2, {doubtful}));
  node->tick(1s);
  node->onObjects(workingSet(3, {}));
  node->onQuery(near({0, 0, 0}, 100));
  ASSERT_THAT(ids(), ElementsAre(3u));
  EXPECT_EQ(recalled_.back().objects[0].existence, sure.existence);
  EXPECT_EQ(recalled_.back().objects[0].memory, Memory::kLongTerm);
}

TEST_F(Recall, SaysWhichFrameOfTheAskersIsOnTheDisk) {
  const auto node = start();
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_EQ(recalled_.back().kept, TimePoint());
  node->onObjects(workingSet(4, {carAt(3, {9, 0, 0})}));
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_EQ(recalled_.back().kept, fromNanoseconds(400'000'000));
  node->onQuery(near({0, 0, 0}, 100, 12));
  EXPECT_EQ(recalled_.back().kept, TimePoint());
}

TEST_F(Recall, ClaimsNothingThatCouldNotBeWritten) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0})}));
  node->tick(0ms);
  const auto other = Connection::open(config_.store_path, Connection::Mode::kReadWriteCreate);
  ASSERT_TRUE(other->execute("BEGIN IMMEDIATE").has_value());
  node->onObjects(workingSet(5, {carAt(1, {0, 0, 0}), carAt(2, {3, 0, 0})}));
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_EQ(recalled_.back().kept, fromNanoseconds(100'000'000));
  EXPECT_EQ(node->reasons().of("busy"), 1u);
}

TEST_F(Recall, TellsThatThereIsMoreThanOneAnswerHolds) {
  config_.query_limit = 2;
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {3, 0, 0}), carAt(2, {1, 0, 0}), carAt(3, {2, 0, 0})}));
  node->onObjects(workingSet(2, {}));
  node->onQuery(near({0, 0, 0}, 100));
  EXPECT_THAT(ids(), ElementsAre(2u, 3u));
  EXPECT_TRUE(recalled_.back().truncated);
}

TEST_F(Recall, RefusesAPlaceThatIsNone) {
  const auto node = start();
  MapQuery query = near({0, 0, 0}, 100);
  query.radius = -1.0;
  node->onQuery(query);
  EXPECT_TRUE(recalled_.empty());
  ASSERT_EQ(replies_.size(), 1u);
  EXPECT_THAT(replies_[0].error, HasSubstr("radius"));
}

}  // namespace
}  // namespace perdure::map_store

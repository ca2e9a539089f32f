// The messages on map/near that the map store sends to a filter without a graph.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

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

class Near : public ::testing::Test {
 protected:
  Near() { config_.store_path = folder_.file("map.sqlite"); }

  std::unique_ptr<Node> start() {
    return std::make_unique<Node>(
        config_, 5,
        Outputs{[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
                [this](const MapReply& r) { replies_.push_back(r); },
                [this](const MapNear& n) { nears_.push_back(n); }});
  }
  /// The working set of a filter at `p` that requests objects nearer than 100 m.
  static Objects setAt(const Eigen::Vector3d& p, std::uint64_t sequence,
                       std::vector<ObjectBelief> beliefs, InstanceId filter = 11) {
    Objects objects = workingSet(sequence, std::move(beliefs), filter);
    objects.T_WB.p = p;
    objects.near_m = 100.0;
    return objects;
  }
  static Objects set(std::uint64_t sequence, std::vector<ObjectBelief> beliefs,
                     InstanceId filter = 11) {
    return setAt({0, 0, 0}, sequence, std::move(beliefs), filter);
  }
  static MapQuery helloOf(InstanceId client) {
    MapQuery query;
    query.client = client;
    query.kind = MapQueryKind::kRestore;
    return query;
  }
  static std::vector<ObjectId> idsOf(const std::vector<ObjectBelief>& beliefs) {
    std::vector<ObjectId> ids;
    for (const auto& o : beliefs) ids.push_back(o.id);
    return ids;
  }
  std::vector<ObjectId> published() const { return idsOf(nears_.back().as_published); }

  TemporaryFolder folder_;
  Config config_;
  std::vector<MapReply> replies_;
  std::vector<MapNear> nears_;
};

TEST_F(Near, GivesWhatIsInNoWorkingSetNearestFirstBitForBit) {
  const auto node = start();
  const auto far = carAt(3, {90, 0, 0}), nearer = carAt(4, {40, 0, 0}),
             there = carAt(5, {41, 0, 0});
  node->onObjects(set(1, {far, nearer, there, carAt(6, {200, 0, 0})}));
  node->tick(0ms);
  node->onObjects(set(2, {there}));
  node->tick(1s);
  ASSERT_THAT(published(), ElementsAre(4u, 3u));
  const MapNear& near = nears_.back();
  EXPECT_THAT(near.placed, IsEmpty());
  EXPECT_THAT(near.members, IsEmpty());
  EXPECT_FALSE(near.more);
  EXPECT_FALSE(near.corrects_drift);
  EXPECT_EQ(near.client, 11u);
  EXPECT_EQ(near.instance, 5u);
  EXPECT_EQ(near.world, (WorldId{77, 1}));
  EXPECT_TRUE(near.stamp.sameFrame(set(2, {}).stamp));
  EXPECT_EQ(near.as_published[0].track, 4u);
  ObjectBelief expected = nearer;  // the belief is equal except its memory and visibility
  expected.memory = Memory::kLongTerm;
  expected.visibility = Visibility::kOutOfView;
  EXPECT_EQ(encodeBelief(near.as_published[0]), encodeBelief(expected));
}

TEST_F(Near, IsSentAfterACommitAndOnTheWayAndNotWhenTheStampAloneHasChanged) {
  const auto node = start();
  node->onObjects(set(1, {carAt(3, {9, 0, 0})}));
  ASSERT_EQ(nears_.size(), 1u) << "the first one of a filter";
  node->tick(0ms);
  ASSERT_EQ(nears_.size(), 2u) << "a commit";
  EXPECT_EQ(nears_.back().kept, fromNanoseconds(100'000'000));
  node->onObjects(set(2, {}));
  node->tick(100ms);
  node->onObjects(setAt({6, 0, 0}, 3, {}));
  node->tick(200ms);
  EXPECT_EQ(nears_.size(), 2u);
  node->onObjects(setAt({7, 0, 0}, 4, {}));
  ASSERT_EQ(nears_.size(), 3u) << "6.7 m travelled";
  EXPECT_THAT(published(), ElementsAre(3u));
  node->onObjects(setAt({14, 0, 0}, 5, {}));
  EXPECT_EQ(nears_.size(), 3u) << "nothing but the stamp has changed";
  node->onObjects(setAt({140, 0, 0}, 6, {}));
  ASSERT_EQ(nears_.size(), 4u);
  EXPECT_THAT(published(), IsEmpty());
  std::uint64_t revision = 0;
  for (const MapNear& near : nears_) EXPECT_EQ(near.revision, ++revision);
}

TEST_F(Near, AnObjectThatIsBackInTheWorkingSetIsNotGivenAgain) {
  const auto node = start();
  node->onObjects(set(1, {carAt(3, {9, 0, 0})}));
  node->tick(0ms);
  node->onObjects(set(2, {}));
  node->tick(1s);
  EXPECT_THAT(published(), ElementsAre(3u));
  node->onObjects(set(3, {carAt(3, {9, 0, 0})}));
  node->tick(2s);
  EXPECT_THAT(published(), IsEmpty());
}

TEST_F(Near, WhatIsGoneOrOfAnotherFrameOfReferenceStaysAway) {
  const auto node = start();
  node->onObjects(set(1, {carAt(3, {9, 0, 0}), carAt(4, {8, 0, 0})}));
  node->tick(0ms);
  Objects next = set(2, {});
  next.ended = {{3, 0, next.stamp.time}};
  node->onObjects(next);
  node->tick(1s);
  EXPECT_THAT(published(), ElementsAre(4u));
  next = set(3, {});
  next.world = {77, 2};
  node->onObjects(next);
  node->tick(2s);
  EXPECT_EQ(nears_.back().world, (WorldId{77, 2}));
  EXPECT_THAT(published(), IsEmpty());
  EXPECT_THAT(nears_.back().placed, IsEmpty());
}

/// Only the process that detected it has the correlation of its errors with those of the present
/// pose.
TEST_F(Near, WhatAFilterBeforeHasDetectedIsPlacedWithoutACorrelation) {
  const auto node = start();
  const auto known = carAt(3, {9, 0, 0});
  node->onObjects(set(1, {known}));
  node->tick(0ms);
  const Objects next = set(40, {carAt(8, {5, 5, 0})}, 12);
  ASSERT_GT(next.stamp.time, known.last_seen);
  node->onObjects(next);
  node->tick(1s);
  const MapNear& near = nears_.back();
  EXPECT_EQ(near.client, 12u);
  EXPECT_THAT(near.as_published, IsEmpty());
  ASSERT_THAT(idsOf(near.placed), ElementsAre(3u));
  EXPECT_TRUE(near.placed[0].best().cross_pose.isZero(0.0));
  EXPECT_EQ(near.placed[0].best().mean, known.best().mean);
  EXPECT_EQ(near.placed[0].best().covariance, known.best().covariance);
}

TEST_F(Near, AFilterThatWantsNothingIsGivenNothing) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(3, {9, 0, 0})}));
  node->tick(0ms);
  node->onObjects(workingSet(2, {}));
  node->tick(1s);
  EXPECT_THAT(published(), IsEmpty());
  EXPECT_EQ(nears_.back().kept, fromNanoseconds(200'000'000)) << "it may let go all the same";
}

TEST_F(Near, OneThatWasNoLongerConfirmedWhenItLeftIsKeptAsItWasBefore) {
  const auto node = start();
  const auto sure = carAt(3, {9, 0, 0});
  node->onObjects(set(1, {sure}));
  node->tick(0ms);
  auto doubtful = sure;
  doubtful.confirmed = false;
  doubtful.existence = 0.6;
  node->onObjects(set(2, {doubtful}));
  node->tick(1s);
  node->onObjects(set(3, {}));
  node->tick(2s);
  ASSERT_THAT(published(), ElementsAre(3u));
  EXPECT_EQ(nears_.back().as_published[0].existence, sure.existence);
  EXPECT_EQ(nears_.back().as_published[0].memory, Memory::kLongTerm);
}

TEST_F(Near, SaysWhichFrameOfItsFilterIsOnTheDisk) {
  const auto node = start();
  node->onQuery(helloOf(11));
  EXPECT_EQ(nears_.back().kept, TimePoint());
  node->onObjects(set(4, {carAt(3, {9, 0, 0})}));
  EXPECT_EQ(nears_.back().kept, TimePoint());
  node->tick(0ms);
  EXPECT_EQ(nears_.back().kept, fromNanoseconds(400'000'000));
  node->onQuery(helloOf(12));
  EXPECT_EQ(nears_.back().client, 12u);
  EXPECT_EQ(nears_.back().kept, TimePoint());
}

TEST_F(Near, ClaimsNothingThatCouldNotBeWritten) {
  const auto node = start();
  node->onObjects(set(1, {carAt(1, {0, 0, 0})}));
  node->tick(0ms);
  const auto other = Connection::open(config_.store_path, Connection::Mode::kReadWriteCreate);
  ASSERT_TRUE(other->execute("BEGIN IMMEDIATE").has_value());
  node->onObjects(setAt({10, 0, 0}, 5, {carAt(1, {0, 0, 0}), carAt(2, {3, 0, 0})}));
  node->tick(1s);
  node->onObjects(setAt({20, 0, 0}, 6, {}));
  EXPECT_TRUE(nears_.back().stamp.sameFrame(set(6, {}).stamp));
  EXPECT_EQ(nears_.back().kept, fromNanoseconds(100'000'000));
  EXPECT_EQ(node->reasons().of("busy"), 1u);
}

TEST_F(Near, SaysThatThereIsMoreThanOneMessageHolds) {
  config_.query_limit = 2;
  const auto node = start();
  node->onObjects(set(1, {carAt(1, {3, 0, 0}), carAt(2, {1, 0, 0}), carAt(3, {2, 0, 0})}));
  node->tick(0ms);
  node->onObjects(set(2, {}));
  node->tick(1s);
  EXPECT_THAT(published(), ElementsAre(2u, 3u));
  EXPECT_TRUE(nears_.back().more);
}

TEST_F(Near, AMergeOfTheFilterGivesBothTracksOneObject) {
  const auto node = start();
  node->onObjects(set(1, {carAt(3, {9, 0, 0}), carAt(7, {9, 1, 0})}));
  node->tick(0ms);
  Objects next = set(2, {carAt(7, {9, 1, 0})});
  next.ended = {{3, 7, next.stamp.time}};
  node->onObjects(next);
  node->tick(1s);
  EXPECT_THAT(nears_.back().members, ElementsAre(Member{7, 3}));
  EXPECT_THAT(published(), IsEmpty());
  next = set(3, {});
  node->onObjects(next);
  node->tick(2s);
  ASSERT_THAT(published(), ElementsAre(3u));
  EXPECT_EQ(nears_.back().as_published[0].best().mean, carAt(7, {9, 1, 0}).best().mean);
}

TEST_F(Near, AQuestionOfARemovedKindIsRefusedInASentence) {
  const auto node = start();
  MapQuery query;
  query.client = 11;
  query.kind = static_cast<MapQueryKind>(6);
  node->onQuery(query);
  EXPECT_THAT(nears_, IsEmpty());
  ASSERT_EQ(replies_.size(), 1u);
  EXPECT_FALSE(replies_[0].ok);
  EXPECT_THAT(replies_[0].error, HasSubstr("map/near"));
}

}  // namespace
}  // namespace perdure::map_store

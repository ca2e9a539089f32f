#include "services/map_store/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "tests/services/map_store/beliefs.h"

namespace perdure::map_store {
namespace {

using namespace std::chrono_literals;
using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Heard {
  std::vector<MapTile> tiles, emptied;
  std::vector<MapHeader> headers;
  std::vector<MapReply> replies;
  std::vector<MapNear> nears;

  Outputs outputs() {
    return {[this](const MapTile& t) { tiles.push_back(t); },
            [this](const MapTile& t) { emptied.push_back(t); },
            [this](const MapHeader& h) { headers.push_back(h); },
            [this](const MapReply& r) { replies.push_back(r); },
            [this](const MapNear& n) { nears.push_back(n); }};
  }
};

class MapStoreNode : public ::testing::Test {
 protected:
  MapStoreNode() { config_.store_path = folder_.file("map.sqlite"); }

  std::unique_ptr<Node> start() { return std::make_unique<Node>(config_, 5, heard_.outputs()); }

  static MapQuery all(std::uint64_t request) {
    MapQuery query;
    query.client = 3;
    query.request = request;
    return query;
  }
  static MapQuery restoreFor(InstanceId client, WorldId world = {}) {
    MapQuery query;
    query.client = client;
    query.kind = MapQueryKind::kRestore;
    query.world = world;
    return query;
  }
  std::size_t durableObjects() const {
    const Connection reading = openStoreForReading(config_.store_path);
    return static_cast<std::size_t>(reading.integer("SELECT count(*) FROM objects").value());
  }

  TemporaryFolder folder_;
  Config config_;
  Heard heard_;
};

TEST_F(MapStoreNode, WritesConfirmedObjectsOnlyAndWithinTheConfiguredPeriod) {
  const auto node = start();
  auto unsure = carAt(2, {1, 0, 0});
  unsure.confirmed = false;
  node->tick(0ms);
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), unsure}));
  node->tick(100ms);
  EXPECT_EQ(durableObjects(), 1u);
  node->onObjects(workingSet(2, {carAt(1, {0, 0, 0}), carAt(3, {4, 0, 0})}));
  node->tick(599ms);
  EXPECT_EQ(durableObjects(), 1u);
  node->tick(600ms);
  EXPECT_EQ(durableObjects(), 2u);
}

TEST_F(MapStoreNode, KeepsAnObjectThatWasConfirmedForOneFrameBetweenCommits) {
  const auto node = start();
  node->onObjects(workingSet(1, {}));
  node->tick(0ms);
  node->onObjects(workingSet(2, {carAt(8, {1, 1, 0})}));
  node->onObjects(workingSet(3, {}));
  node->tick(600ms);
  node->onQuery(all(1));
  ASSERT_EQ(heard_.replies.at(0).objects.size(), 1u);
  EXPECT_EQ(heard_.replies[0].objects[0].id, 8u);
  EXPECT_EQ(heard_.replies[0].objects[0].memory, Memory::kLongTerm);
}

TEST_F(MapStoreNode, GivesANewFilterTheWholeWorkingSetAfterItsOwnRestartToo) {
  auto unsure = carAt(2, {1, 0, 0});
  unsure.confirmed = false;
  const Objects known = workingSet(1, {carAt(1, {0, 0, 0}), unsure, carAt(7, {5, 5, 0})}, 11);
  {
    const auto node = start();
    node->onObjects(known);
    node->tick(0ms);
  }
  heard_ = {};
  const auto node = start();
  node->onQuery(restoreFor(12, {77, 1}));
  const MapNear& near = heard_.nears.at(0);
  EXPECT_EQ(near.client, 12u);
  EXPECT_EQ(near.world, known.world);
  EXPECT_GE(near.next_id, known.next_id);
  EXPECT_THAT(near.as_published, IsEmpty());
  ASSERT_EQ(near.placed.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(near.placed[i].track, known.objects[i].id);
    ObjectBelief but_for_covariances = near.placed[i];
    for (std::size_t k = 0; k < but_for_covariances.classes.size(); ++k) {
      but_for_covariances.classes[k].covariance = known.objects[i].classes[k].covariance;
      but_for_covariances.classes[k].cross_pose = known.objects[i].classes[k].cross_pose;
    }
    EXPECT_EQ(encodeBelief(but_for_covariances), encodeBelief(known.objects[i]));
  }
}

/// The pose error of a new process begins at zero. The part that the old pose error explains is
/// therefore not an error of the objects.
TEST_F(MapStoreNode, AHelloDuringARunGivesAllOfTheFilterBeforeRelativeToTheBody) {
  const auto node = start();
  auto unsure = carAt(2, {1, 0, 0}), moving = carAt(3, {4, 0, 0});
  unsure.confirmed = false;
  moving.moving = 0.9;
  moving.velocity = {2, 0, 0};
  Objects known = workingSet(1, {carAt(1, {0, 0, 0}), unsure, moving}, 11);
  known.pose_error = 0.04 * Eigen::Matrix<double, 6, 6>::Identity();
  known.near_m = 50.0;
  for (ObjectBelief& belief : known.objects) {
    for (ClassBelief& c : belief.classes) {
      c.covariance.setIdentity();
      c.cross_pose.setZero();
      c.cross_pose.topRightCorner<3, 3>() = 0.04 * Eigen::Matrix3d::Identity();
    }
  }
  node->onObjects(known);
  node->tick(0ms);
  node->onQuery(restoreFor(12, known.world));
  const MapNear near = heard_.nears.back();
  EXPECT_EQ(near.client, 12u);
  EXPECT_EQ(near.next_id, known.next_id);
  ASSERT_EQ(near.placed.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const ObjectBelief &given = near.placed[i], &before = known.objects[i];
    EXPECT_EQ(given.id, before.id);
    EXPECT_EQ(given.confirmed, before.confirmed);
    EXPECT_EQ(given.moving, before.moving);
    for (std::size_t k = 0; k < given.classes.size(); ++k) {
      EXPECT_TRUE(given.classes[k].cross_pose.isZero(0.0));
      EXPECT_EQ(given.classes[k].mean, before.classes[k].mean);
      const Matrix7d less = before.classes[k].covariance - given.classes[k].covariance;
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix7d>(less).eigenvalues().minCoeff(), -1e-5);
      EXPECT_NEAR(given.classes[k].covariance(0, 0), 0.96, 1e-5) << "without the body's error";
    }
  }
  const std::size_t before = heard_.nears.size();
  node->onQuery(restoreFor(12, known.world));
  EXPECT_EQ(heard_.nears.size(), before + 1) << "an answer may be lost";
  EXPECT_EQ(heard_.nears.back().placed.size(), 3u);
  EXPECT_GT(heard_.nears.back().revision, near.revision);
}

TEST_F(MapStoreNode, NeverGivesOutAnIdAgainThatMayHaveBeenGivenBeforeItDied) {
  {
    const auto node = start();
    node->onObjects(workingSet(1, {carAt(10, {0, 0, 0})}));
    node->tick(0ms);
    node->onObjects(workingSet(2, {carAt(500, {0, 0, 0})}));  // this object is never written
  }
  const auto node = start();
  node->onQuery(restoreFor(12));
  EXPECT_GT(heard_.nears.back().next_id, 500u);
}

TEST_F(MapStoreNode, SkipsNoIdsOnceTheSameFilterHasSpokenAgain) {
  {
    const auto node = start();
    node->onObjects(workingSet(1, {carAt(10, {0, 0, 0})}));
    node->tick(0ms);
  }
  const auto node = start();
  node->onObjects(workingSet(2, {carAt(11, {0, 0, 0})}));
  node->onQuery(restoreFor(12));
  EXPECT_EQ(heard_.nears.back().next_id, 12u);
}

TEST_F(MapStoreNode, GivesAFilterThatAlreadyPublishedWhatItsPredecessorKnew) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(10, {0, 0, 0})}, 11));
  node->onObjects(workingSet(2, {}, 12));
  node->onQuery(restoreFor(12));
  ASSERT_EQ(heard_.nears.back().placed.size(), 1u);
  EXPECT_EQ(heard_.nears.back().placed[0].id, 10u);
  EXPECT_EQ(heard_.nears.back().next_id, 11u);
}

TEST_F(MapStoreNode, RestoresNothingIntoAnotherFrameOfReferenceButKeepsIdsGoing) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(10, {0, 0, 0})}));
  node->onQuery(restoreFor(12, {78, 1}));
  EXPECT_EQ(heard_.nears.back().client, 12u);
  EXPECT_THAT(heard_.nears.back().placed, IsEmpty());
  EXPECT_THAT(heard_.nears.back().as_published, IsEmpty());
  EXPECT_EQ(heard_.nears.back().next_id, 11u);
}

TEST_F(MapStoreNode, PublishesTheMapAtTheStartAndThenWhatChanged) {
  {
    const auto node = start();
    node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {100, 0, 0})}));
    node->flush();
  }
  heard_ = {};
  const auto node = start();
  node->tick(0ms);
  EXPECT_EQ(heard_.tiles.size(), 2u);
  ASSERT_EQ(heard_.headers.size(), 1u);
  EXPECT_EQ(heard_.headers[0].objects, 2u);
  EXPECT_EQ(heard_.headers[0].tiles, 2u);
  auto moved = carAt(2, {101, 0, 0});
  moved.hits = 8;
  node->onObjects(workingSet(2, {carAt(1, {0, 0, 0}), moved}));
  node->tick(1000ms);
  ASSERT_EQ(heard_.tiles.size(), 3u);
  EXPECT_EQ(heard_.tiles[2].x, 3);
  EXPECT_EQ(heard_.tiles[2].objects.at(0).hits, 8u);
  EXPECT_GT(heard_.headers.at(1).revision, heard_.headers[0].revision);
}

TEST_F(MapStoreNode, DisposesOfTheTileThatItsLastObjectLeft) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0})}));
  node->tick(0ms);
  node->onObjects(workingSet(2, {carAt(1, {40, 0, 0})}));
  node->tick(1000ms);
  ASSERT_EQ(heard_.emptied.size(), 1u);
  EXPECT_EQ(heard_.emptied[0].x, 0);
  EXPECT_EQ(heard_.tiles.back().x, 1);
  EXPECT_EQ(heard_.headers.back().tiles, 1u);
}

TEST_F(MapStoreNode, TakesMergedAndGoneObjectsOffTheMap) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {1, 0, 0}), carAt(3, {9, 0, 0})}));
  node->tick(0ms);
  Objects next = workingSet(2, {carAt(1, {0, 0, 0})});
  next.ended = {{2, 1, next.stamp.time}, {3, 0, next.stamp.time}};
  node->onObjects(next);
  node->tick(1000ms);
  node->onQuery(all(1));
  ASSERT_EQ(heard_.replies.at(0).objects.size(), 1u);
  EXPECT_EQ(heard_.replies[0].objects[0].id, 1u);
  EXPECT_EQ(heard_.headers.back().objects, 1u);
}

/// The filter repeats it until it is on disk, and the store may have restarted meanwhile.
TEST_F(MapStoreNode, AnEndThatIsSaidAgainChangesNothing) {
  Objects next = workingSet(2, {carAt(1, {0, 0, 0})});
  next.ended = {{2, 1, next.stamp.time}, {3, 0, next.stamp.time}};
  {
    const auto node = start();
    node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {1, 0, 0}), carAt(3, {9, 0, 0})}));
    node->tick(0ms);
    node->onObjects(next);
    node->tick(1000ms);
  }
  const auto node = start();
  for (std::uint64_t sequence = 3; sequence < 6; ++sequence) {
    next.stamp = workingSet(sequence, {}).stamp;
    node->onObjects(next);
    node->tick(std::chrono::seconds(sequence));
  }
  node->onQuery(all(1));
  ASSERT_EQ(heard_.replies.at(0).objects.size(), 1u);
  EXPECT_EQ(heard_.replies[0].objects[0].id, 1u);
  EXPECT_EQ(heard_.headers.back().objects, 1u);
}

TEST_F(MapStoreNode, AnObjectThatTheFilterMergedKeepsTheLowestId) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {1, 0, 0})}));
  node->tick(0ms);
  Objects next = workingSet(2, {carAt(2, {1, 0, 0})});
  next.ended = {{1, 2, next.stamp.time}};
  node->onObjects(next);
  node->tick(1000ms);
  node->onQuery(all(1));
  ASSERT_EQ(heard_.replies.at(0).objects.size(), 1u);
  EXPECT_EQ(heard_.replies[0].objects[0].id, 1u);
  EXPECT_EQ(heard_.replies[0].objects[0].mean, carAt(2, {1, 0, 0}).best().mean);
  next = workingSet(3, {});  // the object is gone from here on
  next.ended = {{2, 0, next.stamp.time}};
  node->onObjects(next);
  node->tick(2000ms);
  node->onQuery(all(2));
  EXPECT_THAT(heard_.replies.at(1).objects, IsEmpty());
  EXPECT_EQ(heard_.headers.back().objects, 0u);
}

TEST_F(MapStoreNode, AnswersARepeatedRequestWithTheSameReply) {
  const auto node = start();
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0})}));
  node->tick(0ms);
  node->onQuery(all(1));
  node->onObjects(workingSet(2, {carAt(1, {0, 0, 0}), carAt(2, {3, 0, 0})}));
  node->tick(1000ms);
  node->onQuery(all(1));
  node->onQuery(all(2));
  ASSERT_EQ(heard_.replies.size(), 3u);
  EXPECT_EQ(heard_.replies[1].objects.size(), 1u);
  EXPECT_EQ(heard_.replies[2].objects.size(), 2u);
  EXPECT_EQ(node->reasons().of("query_repeated"), 1u);
}

TEST_F(MapStoreNode, SaysWhatIsWrongWithAQuery) {
  const auto node = start();
  MapQuery query = all(1);
  query.kind = MapQueryKind::kByBox;
  query.low = {1, 1, 1};
  node->onQuery(query);
  EXPECT_FALSE(heard_.replies.at(0).ok);
  EXPECT_THAT(heard_.replies[0].error, HasSubstr("low at most high"));
  EXPECT_EQ(node->reasons().of("query_refused"), 1u);
}

TEST_F(MapStoreNode, CountsObjectsThatHaveNoPlaceAndKeepsTheOthers) {
  const auto node = start();
  auto lost = carAt(2, {0, 0, 0});
  lost.classes[0].mean[1] = std::numeric_limits<double>::quiet_NaN();
  auto far = carAt(3, {0, 0, 0});
  far.classes[0].mean[0] = 1e12;
  node->onObjects(workingSet(1, {carAt(1, {0, 0, 0}), lost, far}));
  node->tick(0ms);
  EXPECT_EQ(durableObjects(), 1u);
  EXPECT_EQ(node->reasons().of("object_invalid"), 2u);
}

TEST_F(MapStoreNode, CountsAFullDiskSaysTheFixAndStillHasWhatWasWritten) {
  config_.max_size_mb = 1;
  const auto node = start();
  std::vector<ObjectBelief> cars;
  for (ObjectId id = 1; id <= 10; ++id) cars.push_back(carAt(id, {1.0 * id, 0, 0}));
  node->onObjects(workingSet(1, cars));
  node->tick(0ms);
  for (ObjectId id = 11; id <= 2000; ++id) cars.push_back(carAt(id, {1.0 * id, 0, 0}));
  node->onObjects(workingSet(2, cars));
  node->tick(1s);
  node->tick(2s);
  EXPECT_EQ(node->reasons().of("disk_full"), 2u);
  EXPECT_THAT(node->trouble(), HasSubstr("store.max_size"));
  EXPECT_EQ(durableObjects(), 10u);
  node->onObjects(workingSet(3, {cars.begin(), cars.begin() + 12}));
  node->tick(3s);
  EXPECT_GE(durableObjects(), 10u);
}

TEST_F(MapStoreNode, CountsALockedMapAndWritesOnceItIsFree) {
  const auto node = start();
  {
    const auto other = Connection::open(config_.store_path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(other->execute("BEGIN IMMEDIATE").has_value());
    node->onObjects(workingSet(1, {carAt(1, {0, 0, 0})}));
    node->tick(0ms);
    EXPECT_EQ(node->reasons().of("busy"), 1u);
    EXPECT_THAT(node->trouble(), HasSubstr("other program"));
  }
  node->tick(600ms);
  EXPECT_EQ(durableObjects(), 1u);
  EXPECT_THAT(node->trouble(), IsEmpty());
}

}  // namespace
}  // namespace perdure::map_store

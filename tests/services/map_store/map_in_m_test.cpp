// The published map of a graph that corrected drift: answers and tiles, in M.
#include <gtest/gtest.h>

#include <set>

#include "tests/services/map_store/lap_drive.h"

namespace perdure::map_store {
namespace {

using namespace test;

class MapInMTest : public LapDrive {
 protected:
  MapInMTest() { drift_ = 2.0 * kDrift; }
};

TEST_F(MapInMTest, AnswersAreInMWhereTheDriftIsTakenOut) {
  start();
  (void)driveToTheLoop();
  node_->flush();
  ASSERT_GT((T_WB_.p - onLap(way_m_).p).norm(), 1.0) << "a drift that shows";
  MapQuery query;
  const MapReply in_M = answerTo(query);
  query.world = kHere;
  const MapReply in_W = answerTo(query);
  ASSERT_EQ(in_M.objects.size(), in_W.objects.size());
  double worst_M = 0.0, worst_W = 0.0;
  for (std::size_t k = 0; k < in_M.objects.size(); ++k) {
    const MapObject& object = in_M.objects[k];
    ASSERT_EQ(object.id, in_W.objects[k].id);
    EXPECT_EQ(object.world, kHere) << "M is the W of the first session";
    EXPECT_FALSE(object.provisional);
    worst_M = std::max(worst_M, (placeOf(object) - truthOf(object.id)).norm());
    worst_W = std::max(worst_W, (placeOf(in_W.objects[k]) - truthOf(object.id)).norm());
  }
  EXPECT_GT(worst_W, 3.0);
  EXPECT_LT(worst_M, 0.5 * worst_W);

  query = {};
  query.kind = MapQueryKind::kById;
  query.object_id = in_M.objects.back().id;
  const MapReply one = answerTo(query);
  ASSERT_EQ(one.beliefs.size(), 1u);
  EXPECT_EQ(one.beliefs[0].best().mean, one.objects.at(0).mean) << "beliefs are in M as well";
  EXPECT_EQ(one.beliefs[0].best().covariance, one.objects[0].covariance);
  EXPECT_NE(one.beliefs[0].best().mean, stored(query.object_id).best().mean);
}

TEST_F(MapInMTest, PlacesAreLookedForInMAndWhereAWIsNamedInThatW) {
  start();
  (void)driveToTheLoop();
  node_->flush();
  std::size_t boxed = 0;
  for (const WorldId& world : {WorldId{}, kHere}) {
    MapQuery query;
    query.world = world;
    const MapReply here = answerTo(query);
    query.kind = MapQueryKind::kByRadius;
    query.low = T_WB_.p;
    query.radius = 20.0;
    std::set<ObjectId> near, found;
    for (const MapObject& object : here.objects) {
      if ((placeOf(object) - query.low).norm() <= query.radius) near.insert(object.id);
    }
    double last = 0.0;
    for (const MapObject& object : answerTo(query).objects) {
      const double distance = (placeOf(object) - query.low).norm();
      EXPECT_GE(distance, last) << "nearest first";
      last = distance;
      found.insert(object.id);
    }
    EXPECT_EQ(found, near);
    EXPECT_FALSE(found.empty());
    query.kind = MapQueryKind::kByBox;
    query.low = T_WB_.p - Eigen::Vector3d::Constant(15.0);
    query.high = T_WB_.p + Eigen::Vector3d::Constant(15.0);
    for (const MapObject& object : answerTo(query).objects) {
      EXPECT_TRUE((placeOf(object).array() >= query.low.array()).all());
      EXPECT_TRUE((placeOf(object).array() <= query.high.array()).all());
      ++boxed;
    }
  }
  EXPECT_GT(boxed, 0u);
}

TEST_F(MapInMTest, TilesAreCutInMAndObjectsThatALoopMovedLeaveTheirOldOnes) {
  config_.tile_size_m = 2.0;
  start();
  (void)driveToTheLoop();
  node_->flush();
  const MapReply all = answerTo({});
  std::map<ObjectId, Eigen::Vector3d> in_tiles;
  std::size_t moved_out = 0;
  for (const auto& [key, tile] : tiles_) {
    for (const MapObject& object : tile.objects) {
      EXPECT_TRUE(in_tiles.emplace(object.id, placeOf(object)).second) << object.id << " twice";
      constexpr double kShown_m = 0.1;
      EXPECT_NEAR(object.mean[0], 2.0 * key[0] + 1.0, 1.0 + kShown_m);
      EXPECT_NEAR(object.mean[1], 2.0 * key[1] + 1.0, 1.0 + kShown_m);
      const Eigen::Vector3d p_W = stored(object.id).best().mean.head<3>();
      moved_out += (placeOf(object) - p_W).head<2>().cwiseAbs().maxCoeff() > 2.0 ? 1 : 0;
    }
  }
  EXPECT_GT(moved_out, 2u) << "of the squares that W would have put them into";
  ASSERT_EQ(in_tiles.size(), all.objects.size());
  for (const MapObject& object : all.objects) {
    EXPECT_LT((in_tiles.at(object.id) - placeOf(object)).norm(), 0.1) << object.id;
  }
}

TEST_F(MapInMTest, WhatALaterSessionSeesIsProvisionalInAnMOfItsOwn) {
  start();
  driveTo(60.0);
  const std::size_t before = thing_of_.size();
  Odometry odometry;
  odometry.world = {78, 1};
  odometry.state = OdometryState::kTracking;
  odometry.stamp = stamp(++sequence_);
  node_->onOdometry(odometry);
  Objects objects = workingSet(sequence_, {carAt(900, {1, 2, 0})}, 12);
  objects.stamp = odometry.stamp;
  objects.world = odometry.world;
  node_->onObjects(objects);
  node_->flush();
  MapQuery query;
  std::size_t provisional = 0;
  for (const MapObject& object : answerTo(query).objects) {
    EXPECT_EQ(object.provisional, object.id == 900) << object.id;
    EXPECT_EQ(object.world, object.id == 900 ? odometry.world : kHere);
    provisional += object.provisional ? 1 : 0;
  }
  EXPECT_EQ(provisional, 1u);
  EXPECT_GT(before, 3u);
  query.kind = MapQueryKind::kByRadius;
  query.low = {1, 2, 0};
  query.radius = 30.0;
  const auto near = answerTo(query).objects;
  ASSERT_EQ(near.size(), 1u) << "places are looked for in the M of the newest session";
  EXPECT_EQ(near[0].id, 900u);
}

TEST_F(MapInMTest, AfterARestartTheMapLiesWhereItLay) {
  start();
  (void)driveToTheLoop();
  node_->flush();
  const MapReply before = answerTo({});
  const auto tiles = tiles_;
  node_.reset();
  tiles_.clear();
  start();
  node_->tick({});
  const MapReply after = answerTo({});
  ASSERT_EQ(after.objects.size(), before.objects.size());
  for (std::size_t k = 0; k < before.objects.size(); ++k) {
    EXPECT_LT((placeOf(after.objects[k]) - placeOf(before.objects[k])).norm(), 1e-9);
  }
  std::size_t objects = 0;
  for (const auto& [key, tile] : tiles_) objects += tile.objects.size();
  EXPECT_EQ(objects, before.objects.size());
}

}  // namespace
}  // namespace perdure::map_store

// The answers of map_store to queries about its graph.
#include "services/map_store/core/graph/graph_answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/types/map_graph.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/schema.h"
#include "tests/services/map_store/lap_drive.h"

namespace perdure::map_store {
namespace {

using namespace test;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class GraphAnswer : public LapDrive {
 protected:
  MapReply graph(double radius_m = 0.0, std::uint32_t limit = 2000) {
    MapQuery query;
    query.client = 3;
    query.request = ++request_;
    query.kind = MapQueryKind::kGraph;
    query.low = node_->mapper().T_MW() * T_WB_.p;
    query.radius = radius_m;
    query.limit = limit;
    node_->onQuery(query);
    EXPECT_EQ(replies_.back().request, query.request);
    return replies_.back();
  }
  static const MapAnchor* anchorOf(const MapReply& reply, AnchorNumber id) {
    const auto at = std::find_if(reply.anchors.begin(), reply.anchors.end(),
                                 [&](const MapAnchor& a) { return a.id == id; });
    return at == reply.anchors.end() ? nullptr : &*at;
  }
};

TEST_F(GraphAnswer, HoldsAnchorsWhereTheyLieInMAndHowWellThatIsKnown) {
  start();
  driveTo(0.8 * kLap_m);
  const MapReply reply = graph();
  ASSERT_TRUE(reply.ok) << reply.error;
  EXPECT_FALSE(reply.truncated);
  ASSERT_EQ(reply.anchors.size(), node_->mapper().anchors().size());
  EXPECT_EQ(reply.anchor_count, reply.anchors.size());
  EXPECT_THAT(reply.loops, IsEmpty());
  double before = -1.0;
  std::uint32_t objects = 0;
  for (const MapAnchor& anchor : reply.anchors) {
    EXPECT_EQ(anchor.session, kHere);
    EXPECT_EQ(anchor.map, kHere);
    EXPECT_EQ(anchor.p, node_->mapper().graph().pose(anchor.id).p);
    EXPECT_EQ(anchor.previous, anchor.id - 1);
    EXPECT_GT(anchor.sigma[3], before) << "without loops the heading is known ever worse";
    before = anchor.sigma[3];
    objects += anchor.objects;
  }
  EXPECT_EQ(reply.anchors.front().sigma, Eigen::Vector4d::Zero());
  EXPECT_GE(objects, things_.size() / 2);
}

TEST_F(GraphAnswer, ABadQueryIsRefusedAsOneOfTheGraph) {
  start();
  EXPECT_THAT(graph(-1.0).error, HasSubstr("a graph query needs"));
  EXPECT_THAT(graph(0.0, 0).error, HasSubstr("limit is 0; it must be at least 1"));
}

TEST_F(GraphAnswer, SaysOfALoopByWhichObjectsAndHowWellItFits) {
  start();
  driveToTheLoop();
  driveTo(way_m_ + 20.0);
  const double open_m = graph().anchors.back().sigma.head<2>().norm();
  const MapReply reply = graph();
  ASSERT_THAT(reply.loops, Not(IsEmpty()));
  std::size_t confirmed = 0;
  for (const MapLoop& loop : reply.loops) {
    const MapAnchor *a = anchorOf(reply, loop.a), *b = anchorOf(reply, loop.b);
    ASSERT_TRUE(a != nullptr && b != nullptr);
    EXPECT_LT(a->id, b->id);
    EXPECT_GT(loop.sigma.minCoeff(), 0.0);
    const double by_size = (loop.residual.array() / loop.sigma.array()).matrix().squaredNorm();
    EXPECT_GT(loop.chi2 + 1e-6, 0.1 * by_size);
    if (loop.kind != MapLoopKind::kLoop || loop.state != MapLoopState::kConfirmed) continue;
    ++confirmed;
    EXPECT_GE(loop.weight, 0.5);
    EXPECT_LT(loop.residual.head<3>().norm(), 1.0);
    EXPECT_THAT(loop.pairs, Not(IsEmpty()));
    for (const MapLoopPair& pair : loop.pairs) {
      EXPECT_EQ(thing_of_.at(pair.known), thing_of_.at(pair.seen));
    }
  }
  EXPECT_GE(confirmed, 1u);
  EXPECT_EQ(reply.loop_count, reply.loops.size());
  EXPECT_LT(open_m, 3.0);
}

TEST_F(GraphAnswer, IsOfTheNearestAnchorsAndSaysThatThereAreMore) {
  start();
  driveToTheLoop();
  const MapReply all = graph();
  const MapReply few = graph(0.0, 4);
  ASSERT_THAT(few.anchors, SizeIs(4));
  EXPECT_TRUE(few.truncated);
  EXPECT_EQ(few.anchor_count, all.anchors.size());
  EXPECT_EQ(few.loop_count, all.loop_count);
  const Eigen::Vector3d body_M = node_->mapper().T_MW() * T_WB_.p;
  double farthest = 0.0;
  for (const MapAnchor& anchor : few.anchors) {
    farthest = std::max(farthest, (anchor.p - body_M).norm());
  }
  for (const MapAnchor& anchor : all.anchors) {
    EXPECT_TRUE(anchorOf(few, anchor.id) != nullptr || (anchor.p - body_M).norm() >= farthest);
  }
  for (const MapLoop& loop : few.loops) {
    EXPECT_TRUE(anchorOf(few, loop.a) != nullptr && anchorOf(few, loop.b) != nullptr);
  }
  const MapReply near = graph(30.0);
  EXPECT_FALSE(near.truncated);
  EXPECT_LT(near.anchors.size(), all.anchors.size());
  for (const MapAnchor& anchor : near.anchors) EXPECT_LE((anchor.p - body_M).norm(), 30.0);
}

TEST_F(GraphAnswer, OutlivesTheProcessBeforeAnyOdometry) {
  start();
  driveToTheLoop();
  const MapReply before = graph();
  node_->flush();
  node_.reset();
  start();
  const MapReply after = graph();
  ASSERT_EQ(after.anchors.size(), before.anchors.size());
  ASSERT_EQ(after.loops.size(), before.loops.size());
  for (std::size_t i = 0; i < after.anchors.size(); ++i) {
    EXPECT_EQ(after.anchors[i].p, before.anchors[i].p);
    EXPECT_LT((after.anchors[i].sigma - before.anchors[i].sigma).norm(), 1e-6);
  }
  std::size_t known = 0;
  for (const MapLoop& loop : after.loops) known += loop.pairs.size();
  EXPECT_GT(known, 0u) << "by the facts that rest on it";
}

TEST_F(GraphAnswer, ShowsWithdrawnLoopsWithWhatTheySaid) {
  start();
  driveTo(0.8 * kLap_m);
  node_->flush();
  node_.reset();
  const auto file = openStoreForReading(config_.store_path);
  mapping::Mapper mapper(config_.mapping, MapReader(&file).graph()->map);
  const mapping::AnchorId last = mapper.anchors().rbegin()->first;
  mapping::Edge edge{1, last, {}, mapping::EdgeKind::kLoop};
  edge.T_ab.mean = mapper.graph().pose(1).inverse() * mapper.graph().pose(last);
  edge.T_ab.mean.p.x() += 25.0;
  edge.T_ab.covariance = 0.04 * Eigen::Matrix4d::Identity();
  MapQuery query;
  MapReply reply;
  putGraph(mapper, {{9, 1, last, edge, {{4, 70}}, 3}}, kHere, query, reply);
  ASSERT_THAT(reply.loops, SizeIs(1));
  EXPECT_EQ(reply.loops[0].state, MapLoopState::kWithdrawn);
  EXPECT_EQ(reply.loops[0].id, 9u);
  EXPECT_NEAR(reply.loops[0].residual.x(), 25.0, 1e-9);
  EXPECT_DOUBLE_EQ(reply.loops[0].sigma.x(), 0.2);
  EXPECT_EQ(reply.loops[0].weight, 0.0);
  ASSERT_THAT(reply.loops[0].pairs, SizeIs(1));
  EXPECT_EQ(reply.loops[0].pairs[0].seen, 70u);
  EXPECT_EQ(reply.loops[0].landmarks, 3u);
}

/// Values that are finite but only a damaged file can have.
TEST_F(GraphAnswer, SaysWhereHowWellAPlaceIsKnownCannotBeTold) {
  start();
  driveTo(0.8 * kLap_m);
  node_->flush();
  node_.reset();
  const auto file = openStoreForReading(config_.store_path);
  mapping::SavedMap map = MapReader(&file).graph()->map;
  const AnchorNumber cut = map.anchors.rbegin()->first / 2;
  map.anchors.at(cut).anchor.from_previous.covariance.setConstant(0.0);
  map.anchors.at(cut).anchor.from_previous.covariance.diagonal().setConstant(1e30);
  mapping::Edge edge{1, cut, {}, mapping::EdgeKind::kLoop};
  edge.T_ab.covariance = -Eigen::Matrix4d::Identity();
  MapReply reply;
  mapping::Mapper mapper(config_.mapping, std::move(map));
  putGraph(mapper, {{9, 1, cut, edge, {}, 3}}, kHere, {}, reply);
  ASSERT_GT(reply.anchors.size(), 4u);
  for (const MapAnchor& anchor : reply.anchors) {
    EXPECT_TRUE(anchor.sigma.allFinite());
    EXPECT_TRUE(anchor.id < cut || !hasSigma(anchor)) << anchor.sigma.transpose();
  }
  ASSERT_THAT(reply.loops, SizeIs(1));
  EXPECT_FALSE(hasSigma(reply.loops[0]));
}

TEST_F(GraphAnswer, WithoutAGraphOrOfNoPlaceIsRefusedInASentence) {
  config_.graph = false;
  start();
  driveTo(20.0);
  const MapReply none = graph();
  EXPECT_FALSE(none.ok);
  EXPECT_THAT(none.error, HasSubstr("graph.enabled"));
  EXPECT_FALSE(graph(-1.0).ok);
  EXPECT_EQ(node_->reasons().of("query_refused"), 2u);
}

}  // namespace
}  // namespace perdure::map_store

// Tests the output of `perdure map graph`.
#include "tools/map/graph_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/gateway/objects.h"

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const WorldId kMap{70, 1};

TEST(GraphView, TellsAnchorsWayLoopsAndTheWorstSigma) {
  const std::string text = toGraphText(gateway::test::graphFor({}, kMap));
  EXPECT_THAT(text, HasSubstr("world 70, epoch 1"));
  EXPECT_THAT(text, HasSubstr("3 of 1 session, 20 m travelled"));
  EXPECT_THAT(text, HasSubstr("worst at anchor 2: sigma 0.20 0.10 0.05 m, 0.57 deg"));
  EXPECT_THAT(text, HasSubstr("of 1 anchor not known")) << "the third, which is not the first of M";
  EXPECT_THAT(text, HasSubstr("1 confirmed, 1 tentative, 1 withdrawn; ties 1"));
  EXPECT_THAT(text, Not(HasSubstr("nearest of")));
}

TEST(GraphView, TellsOnWhatALoopRests) {
  MapReply graph = gateway::test::graphFor({}, kMap);
  EXPECT_THAT(toGraphText(graph), HasSubstr("objects 1, 2 (seen as 77)"));
  graph.loops[0].pairs.clear();
  graph.loops[0].landmarks = 31;
  graph.loops[1].pairs.clear();
  EXPECT_THAT(toGraphText(graph), HasSubstr("31 landmarks that look alike"));
  EXPECT_THAT(toGraphText(graph), HasSubstr("not known any more"));
}

TEST(GraphView, SaysThatItIsAPartAndThatThereIsNone) {
  MapReply graph = gateway::test::graphFor({}, kMap);
  graph.truncated = true;
  graph.anchor_count = 500;
  EXPECT_THAT(toGraphText(graph), HasSubstr("the nearest of 500 anchors"));
  EXPECT_EQ(toGraphText({}), "the map has no anchors yet\n");
}

TEST(GraphView, AsJsonHasNullWhereSigmaIsNotKnown) {
  const auto json = toGraphJson(gateway::test::graphFor({}, kMap));
  EXPECT_EQ(json["unknown_sigma"], 1);
  EXPECT_EQ(json["anchors"][0]["sigma"], (nlohmann::ordered_json{0, 0, 0, 0}));
  EXPECT_TRUE(json["anchors"][2]["sigma"].is_null());
  EXPECT_TRUE(json["loops"][3]["sigma"].is_null());
  EXPECT_EQ(json["loops"][1]["pairs"][1][1], 77);
}

}  // namespace
}  // namespace perdure::tools

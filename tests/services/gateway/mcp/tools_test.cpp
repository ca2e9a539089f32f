// Tests the tools on a map in memory.
#include "services/gateway/mcp/tools.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/gateway/mcp/town.h"

namespace perdure::gateway::test {
namespace {

using mcp::Json;
using ::testing::HasSubstr;

class McpTools : public ::testing::Test {
 protected:
  Json answerTo(const std::string& tool, const std::string& arguments) {
    const auto result = mcp::callTool(tool, Json::parse(arguments), town_);
    EXPECT_TRUE(result.has_value());
    EXPECT_EQ((*result)["isError"], false) << result->dump();
    EXPECT_EQ(Json::parse((*result)["content"][0]["text"].get<std::string>()),
              (*result)["structuredContent"]);
    return (*result)["structuredContent"];
  }
  std::string refusalOf(const std::string& tool, const std::string& arguments) {
    const auto result = mcp::callTool(tool, Json::parse(arguments), town_);
    EXPECT_EQ((*result)["isError"], true) << result->dump();
    return (*result)["content"][0]["text"];
  }
  static std::vector<int> idsOf(const Json& objects) {
    std::vector<int> ids;
    for (const Json& each : objects) ids.push_back(each["id"]);
    return ids;
  }
  static void expectSum(const Json& item) {
    double sum = 0.0;
    for (const auto& [kind, entry] : item["evidence"].items())
      sum += entry["log_odds"].get<double>();
    EXPECT_NEAR(sum, item["log_odds"].get<double>(), 1e-6) << item.dump(1);
    EXPECT_NEAR(1.0 / (1.0 + std::exp(-sum)), item["probability"].get<double>(), 1e-6);
  }
  Town town_;
};

TEST_F(McpTools, FindsObjectsByClassTextPlaceAndTime) {
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"class":"car"})")["objects"]),
              ::testing::UnorderedElementsAre(1, 2));
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"text":"Are there any vans?"})")["objects"]),
              ::testing::ElementsAre(3));
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"near":[10,4],"radius_m":3})")["objects"]),
              ::testing::ElementsAre(1));
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"seen_since_s":50})")["objects"]),
              ::testing::ElementsAre(2));
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"seen_until_s":50,"class":"car"})")["objects"]),
              ::testing::ElementsAre(1));
  EXPECT_THAT(idsOf(answerTo("find_objects", R"({"min_probability":0.95})")["objects"]),
              ::testing::IsEmpty());
  EXPECT_EQ(answerTo("find_objects", R"({"limit":2})")["truncated"], true);
}

TEST_F(McpTools, EachAnswerHasProbabilityAgeAndEntriesThatSumToIt) {
  for (const auto& [tool, arguments, list] :
       {std::tuple("find_objects", R"({})", "objects"),
        std::tuple("where_last_seen", R"({"text":"car bicycle"})", "objects"),
        std::tuple("what_changed", R"({"since_s":0})", "changes"),
        std::tuple("never_seen", R"({"near":[20,0],"radius_m":30})", "regions")}) {
    const Json answer = answerTo(tool, arguments);
    ASSERT_FALSE(answer[list].empty()) << tool;
    for (const Json& item : answer[list]) {
      expectSum(item);
      EXPECT_TRUE(item.contains("age_s"));
    }
  }
  const Json object = answerTo("why", R"({"id":1})")["object"];
  expectSum(object);
  EXPECT_EQ(object["age_s"], 75.0) << "the miss at 25 s is its last evidence";
  EXPECT_EQ(object["evidence"].size(), 3u);
}

TEST_F(McpTools, CorrectsTheMapOnlyWhereThatIsAllowed) {
  const std::string wrong = R"({"object":1,"kind":"not_there","nats":2.5})";
  EXPECT_FALSE(mcp::callTool("correct", Json::parse(wrong), town_).has_value());
  EXPECT_EQ(mcp::listTools(town_).size(), 5u);
  town_.takes_corrections = true;
  const Json tools = mcp::listTools(town_);
  ASSERT_EQ(tools.size(), 6u);
  EXPECT_EQ(tools[5]["annotations"]["readOnlyHint"], false);
  const Json answer = answerTo("correct", wrong);
  expectSum(answer["object"]);
  EXPECT_EQ(answer["object"]["evidence"]["person"]["log_odds"], -2.5);
  EXPECT_EQ(answer["correction"]["author"], "assistant");
  EXPECT_EQ(answerTo("correct", R"({"withdraw":3})")["correction"]["withdrawn"], true);
  const Json left = answerTo("correct", R"({"object":77,"kind":"not_there"})");
  EXPECT_TRUE(left["object"].is_null()) << "it is not on the map any more";
  EXPECT_EQ(left["correction"]["object"], 77);
  EXPECT_EQ(tools[5]["outputSchema"]["properties"]["object"]["type"],
            Json::array({"object", "null"}));
  for (const char* unfit : {"{}", R"({"object":1})", R"({"object":1,"kind":"same"})",
                            R"({"object":1,"kind":"class"})", R"({"kind":"not_there"})"}) {
    EXPECT_THAT(refusalOf("correct", unfit), HasSubstr("correct as {\"object\": 12")) << unfit;
  }
  EXPECT_THAT(refusalOf("correct", R"({"object":1,"kind":"gone"})"), HasSubstr("not_there"));
}

TEST_F(McpTools, WhatTheLedgerLacksIsAnEntry) {
  town_.beliefs[0].why = {};
  const Json bare = answerTo("why", R"({"id":1})")["object"];
  expectSum(bare);
  EXPECT_NEAR(bare["evidence"]["unexplained"]["log_odds"].get<double>(), std::log(9.0), 1e-6);
  town_.beliefs[1].existence = 0.5;
  expectSum(answerTo("why", R"({"id":2})")["object"]);
}

TEST_F(McpTools, TheProbabilityOfAnyMatchIsThatOfItsParts) {
  const Json one = answerTo("find_objects", R"({"class":"car","near":[10,5],"radius_m":2})");
  EXPECT_NEAR(one["probability"].get<double>(), 0.9 * town_.beliefs[0].best().probability, 0.01);
  double log_none = 0.0;
  for (const auto& [what, part] : one["log_none"].items()) log_none += part.get<double>();
  EXPECT_NEAR(one["probability"].get<double>(), 1.0 - std::exp(log_none), 1e-9);
  const Json none = answerTo("find_objects", R"({"class":"van","near":[10,5],"radius_m":2})");
  EXPECT_LT(none["probability"].get<double>(), 0.01);
}

TEST_F(McpTools, GroundThatNobodyLookedAtMayHaveObjects) {
  const Json behind = answerTo("find_objects", R"({"class":"car","near":[-8,0],"radius_m":6})");
  EXPECT_GT(behind["expected_unseen"].get<double>(), 0.1);
  EXPECT_GT(behind["probability"].get<double>(), 0.1);
  town_.state.cameras.clear();
  EXPECT_TRUE(
      answerTo("find_objects", R"({"near":[-30,0],"radius_m":10})")["expected_unseen"].is_null());
  EXPECT_THAT(refusalOf("never_seen", R"({"near":[0,0],"radius_m":10})"),
              HasSubstr("fields of view"));
}

TEST_F(McpTools, TheDiscBehindTheFirstAnchorWasNeverSeenAndTheRoadWas) {
  const Json behind = answerTo("never_seen", R"({"near":[-30,0],"radius_m":5})");
  ASSERT_EQ(behind["regions"].size(), 1u);
  EXPECT_NEAR(behind["unseen_m2"].get<double>(), M_PI * 25.0, 4.0);
  EXPECT_EQ(behind["regions"][0]["probability"], 1.0);
  const Json road = answerTo("never_seen", R"({"near":[14,0],"radius_m":1})");
  EXPECT_EQ(road["unseen_m2"], 0.0);
}

TEST_F(McpTools, AnObjectHidesTheGroundBehindIt) {
  town_.anchors.resize(1);
  const std::string behind = R"({"near":[14,0],"radius_m":1})";
  EXPECT_EQ(answerTo("never_seen", behind)["unseen_m2"], 0.0);
  town_.beliefs.push_back(known(9, "van", {8, 0, 0}));
  EXPECT_GT(answerTo("never_seen", behind)["unseen_m2"].get<double>(), 1.0);
}

TEST_F(McpTools, AGoneObjectAndAMergedOneAreFound) {
  const Json gone = answerTo("where_last_seen", R"({"id":4})")["objects"][0];
  EXPECT_EQ(gone["status"], "gone");
  EXPECT_EQ(gone["ended_s"], 90.0);
  const Json merged = answerTo("where_last_seen", R"({"id":5})")["objects"][0];
  EXPECT_EQ(merged["id"], 1);
  EXPECT_EQ(merged["merged_from"], 5);
  EXPECT_THAT(idsOf(answerTo("where_last_seen", R"({"class":"car","limit":1})")["objects"]),
              ::testing::ElementsAre(2))
      << "the latest first";
  EXPECT_THAT(refusalOf("where_last_seen", R"({"id":77})"), HasSubstr("no object 77"));
}

TEST_F(McpTools, ChangesAreThoseSinceTheTime) {
  const Json changes = answerTo("what_changed", R"({"since_s":50})")["changes"];
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0]["change"], "gone");
  EXPECT_EQ(changes[0]["id"], 4);
  EXPECT_EQ(changes[1]["change"], "appeared");
  EXPECT_EQ(changes[1]["id"], 2);
  EXPECT_EQ(
      answerTo("what_changed", R"({"since_s":50,"near":[40,5],"radius_m":2})")["changes"].size(),
      1u);
}

TEST_F(McpTools, WrongArgumentsAreRefusedWithTheFix) {
  EXPECT_THAT(refusalOf("find_objects", R"({"clas":"car"})"), HasSubstr("this tool takes: class"));
  EXPECT_THAT(refusalOf("find_objects", R"({"near":[1,2]})"), HasSubstr("together"));
  EXPECT_THAT(refusalOf("find_objects", R"({"near":[1],"radius_m":2})"), HasSubstr("near"));
  EXPECT_THAT(refusalOf("find_objects", R"({"near":[1,2],"radius_m":-2})"), HasSubstr("radius_m"));
  EXPECT_THAT(refusalOf("find_objects", R"({"near":[1e9,2],"radius_m":2})"), HasSubstr("near"));
  EXPECT_THAT(refusalOf("find_objects", R"({"limit":1.5})"), HasSubstr("limit"));
  EXPECT_THAT(refusalOf("find_objects", R"({"limit":51})"), HasSubstr("limit"));
  EXPECT_THAT(refusalOf("why", R"({})"), HasSubstr("give the argument id"));
  EXPECT_THAT(refusalOf("where_last_seen", R"({})"), HasSubstr("give id"));
}

}  // namespace
}  // namespace perdure::gateway::test

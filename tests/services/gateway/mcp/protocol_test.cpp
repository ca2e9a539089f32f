// Tests the JSON-RPC and MCP messages without a transport.
#include "services/gateway/mcp/protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/services/gateway/mcp/town.h"

namespace perdure::gateway::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class McpProtocol : public ::testing::Test {
 protected:
  json said(const std::string& message, int status = 200) {
    const mcp::Answer answer = mcp::answer(message, town_);
    EXPECT_EQ(answer.status, status) << message << "\n" << answer.text;
    EXPECT_EQ(answer.text.find('\n'), std::string::npos) << "stdio has one message a line";
    return answer.text.empty() ? json() : json::parse(answer.text);
  }
  json asked(const std::string& method, const json& params, int status = 200) {
    return said(json{{"jsonrpc", "2.0"}, {"id", 7}, {"method", method}, {"params", params}}.dump(),
                status);
  }
  int errorOf(const std::string& message, int status = 200) {
    return said(message, status)["error"]["code"].get<int>();
  }
  Town town_;
};

TEST_F(McpProtocol, AgreesOnEachRevisionAndOffersTheNewestForOthers) {
  for (const char* revision : {"2024-11-05", "2025-03-26", "2025-06-18"}) {
    const json result = asked("initialize", {{"protocolVersion", revision}})["result"];
    EXPECT_EQ(result["protocolVersion"], revision);
    EXPECT_EQ(result["serverInfo"]["name"], "perdure");
    EXPECT_TRUE(result["capabilities"].contains("tools"));
  }
  EXPECT_EQ(asked("initialize", {{"protocolVersion", "2031-01-01"}})["result"]["protocolVersion"],
            "2025-06-18");
  EXPECT_EQ(asked("initialize", json::object())["error"]["code"], -32602);
}

TEST_F(McpProtocol, AnswersWithTheIdOfTheRequest) {
  EXPECT_EQ(said(R"({"jsonrpc":"2.0","id":"a-1","method":"ping"})"),
            json::parse(R"({"jsonrpc":"2.0","id":"a-1","result":{}})"));
  EXPECT_EQ(said(R"({"jsonrpc":"2.0","id":0,"method":"ping"})")["id"], 0);
}

TEST_F(McpProtocol, NotificationsAndResponsesGetNoAnswer) {
  for (const char* message :
       {R"({"jsonrpc":"2.0","method":"notifications/initialized"})",
        R"({"jsonrpc":"2.0","method":"notifications/cancelled","params":{"requestId":7}})",
        R"({"jsonrpc":"2.0","method":"no/such"})", R"({"jsonrpc":"2.0","id":1,"result":{}})",
        R"([{"jsonrpc":"2.0","method":"notifications/initialized"}])"}) {
    EXPECT_TRUE(said(message, 202).is_null()) << message;
  }
}

TEST_F(McpProtocol, NamesEachErrorByItsCode) {
  EXPECT_EQ(errorOf("{", 400), -32700);
  EXPECT_EQ(errorOf("[]", 400), -32600);
  EXPECT_EQ(errorOf("7", 400), -32600);
  EXPECT_EQ(errorOf(R"({"id":1,"method":"ping"})", 400), -32600) << "no jsonrpc";
  EXPECT_EQ(errorOf(R"({"jsonrpc":"2.0","id":null,"method":"ping"})", 400), -32600);
  EXPECT_EQ(errorOf(R"({"jsonrpc":"2.0","id":1.5,"method":"ping"})", 400), -32600);
  EXPECT_EQ(errorOf(R"({"jsonrpc":"2.0","id":1,"method":"resources/list"})"), -32601);
  EXPECT_EQ(errorOf(R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":[]})"), -32602);
  EXPECT_EQ(asked("tools/call", {{"name", "no_such"}})["error"]["code"], -32602);
  EXPECT_EQ(asked("tools/call", {{"name", "why"}, {"arguments", 3}})["error"]["code"], -32602);
}

TEST_F(McpProtocol, AnswersABatchInOneMessage) {
  const json answers = said(R"([{"jsonrpc":"2.0","id":1,"method":"ping"},
    {"jsonrpc":"2.0","method":"notifications/initialized"},
    {"jsonrpc":"2.0","id":2,"method":"no/such"}])");
  ASSERT_EQ(answers.size(), 2u);
  EXPECT_EQ(answers[0]["id"], 1);
  EXPECT_EQ(answers[1]["error"]["code"], -32601);
}

TEST_F(McpProtocol, ToolsOnlyRead) {
  const json tools = asked("tools/list", json::object())["result"]["tools"];
  ASSERT_EQ(tools.size(), 5u);
  for (const json& tool : tools) {
    EXPECT_EQ(tool["annotations"]["readOnlyHint"], true) << tool;
    EXPECT_EQ(tool["inputSchema"]["type"], "object");
    EXPECT_EQ(tool["outputSchema"]["type"], "object");
  }
}

TEST_F(McpProtocol, TextThatIsNotUtf8GetsAnAnswer) {
  EXPECT_EQ(errorOf("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"\xff\"}", 400), -32700);
}

}  // namespace
}  // namespace perdure::gateway::test

// Tests `perdure mcp` as a process on a map's file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "services/map_store/core/map_database.h"
#include "tests/process/support.h"
#include "tests/services/map_store/beliefs.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using map_store::test::carAt;
using map_store::test::TemporaryFolder;
using map_store::test::workingSet;
using nlohmann::json;
using ::testing::HasSubstr;

constexpr char kPing[] = R"({"jsonrpc":"2.0","id":1,"method":"ping"})";

class McpProcess : public ::testing::Test {
 protected:
  McpProcess() {
    const Objects objects = workingSet(1, {carAt(10, {5, 1, 0}), carAt(20, {9, 1, 0})});
    map_store::MapDatabase database({folder_.file("map.sqlite")});
    EXPECT_TRUE(database.write({&objects, {}, {}}).has_value());
  }
  /// Runs the server with `input`; sets status_, and returns its output and error messages.
  std::string outputOf(const std::string& map, const std::string& input) {
    std::ofstream(folder_.file("input")) << input;
    Child child({"sh", "-c",
                 '"' + (programs() / "perdure").string() + "\" mcp --map " + map + " < " +
                     folder_.file("input")},
                folder_.file("log"));
    status_ = child.wait(30s);
    return child.log();
  }

  TemporaryFolder folder_;
  int status_ = -1;
};

TEST_F(McpProcess, WritesOneAnswerALineAndNothingElse) {
  const std::string call =
      R"({"jsonrpc":"2.0","id":2,"method":"tools/call",)"
      R"("params":{"name":"find_objects","arguments":{"class":"car","limit":1}}})";
  const std::string input = std::string(kPing) + "\n\n" +
                            R"({"jsonrpc":"2.0","method":"notifications/initialized"})" + "\r\n" +
                            call + "\n" + kPing;  // the last line has no end
  for (const std::string& map : {folder_.file("map.sqlite"), folder_.path().string()}) {
    std::istringstream lines(outputOf(map, input));
    EXPECT_EQ(status_, 0);
    std::vector<json> answers;
    for (std::string line; std::getline(lines, line);) answers.push_back(json::parse(line));
    ASSERT_EQ(answers.size(), 3u);
    EXPECT_EQ(answers[1]["id"], 2);
    const json& result = answers[1]["result"]["structuredContent"];
    EXPECT_EQ(result["objects"].size(), 1u);
    EXPECT_EQ(result["truncated"], true);
    EXPECT_EQ(answers[2]["result"], json::object());
  }
}

TEST_F(McpProcess, CorrectsAFileOnlyIfThatIsAllowed) {
  const std::string call =
      R"({"jsonrpc":"2.0","id":2,"method":"tools/call","params":{"name":"correct","arguments":)"
      R"({"object":20,"kind":"same","other":10,"author":"Ada"}}})";
  const std::string map = folder_.file("map.sqlite");
  EXPECT_EQ(json::parse(outputOf(map, call))["error"]["code"], -32602);
  const json made = json::parse(outputOf(map + " --allow-corrections", call))["result"];
  EXPECT_EQ(made["structuredContent"]["object"]["id"], 10) << made.dump(1);
  EXPECT_EQ(made["structuredContent"]["correction"]["author"], "Ada");
}

TEST_F(McpProcess, RefusesWhatIsNoMap) {
  EXPECT_THAT(outputOf(folder_.file("none.sqlite"), kPing), HasSubstr("There is no map"));
  EXPECT_EQ(status_, 69);
  std::ofstream(folder_.file("text")) << "not a map of Perdure's, but a text of some length\n";
  (void)outputOf(folder_.file("text"), kPing);
  EXPECT_EQ(status_, 78);
  EXPECT_THAT(outputOf(folder_.file("map.sqlite"), std::string(2 << 20U, ' ')),
              HasSubstr("longer than 1 MiB"));
  EXPECT_EQ(status_, 65);
}

}  // namespace
}  // namespace perdure::test

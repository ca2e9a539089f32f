// Tests `perdure map correct` on a file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/errors.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tools/map/correct_command.h"
#include "tools/map/map_source.h"

namespace perdure::tools {
namespace {

using map_store::test::carAt;
using map_store::test::workingSet;
using ::testing::HasSubstr;

class CorrectCommand : public ::testing::Test {
 protected:
  CorrectCommand() {
    const Objects cars = workingSet(1, {carAt(1, {0, 0, 0}), carAt(2, {9, 0, 0})});
    EXPECT_TRUE(map_store::MapDatabase({path_}).write({&cars, {}, {}}).has_value());
  }
  /// Runs the command and returns what it prints.
  std::string run(std::vector<std::string> words) {
    CLI::App app;
    addCorrectCommand(app);
    words.insert(words.begin(), {"correct", "--db", path_});
    std::reverse(words.begin(), words.end());
    ::testing::internal::CaptureStdout();
    try {
      app.parse(std::move(words));
    } catch (...) {
      (void)::testing::internal::GetCapturedStdout();
      throw;
    }
    return ::testing::internal::GetCapturedStdout();
  }
  std::string refusal(const std::vector<std::string>& words, ExitCode expected) {
    try {
      (void)run(words);
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), expected) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return {};
  }
  MapObject object(ObjectId id) {
    MapQuery query;
    query.kind = MapQueryKind::kById;
    query.object_id = id;
    return MapFile(path_).ask(query).objects.at(0);
  }

  map_store::test::TemporaryFolder folder_;
  std::string path_ = folder_.file("map.sqlite");
};

TEST_F(CorrectCommand, ACorrectionStandsUntilItIsWithdrawn) {
  const double before = object(1).existence;
  const auto made = nlohmann::json::parse(
      run({"1", "--not-there", "--nats", "2.5", "--author", "Ada", "--json"}));
  EXPECT_EQ(made.at(0).at("kind"), "not_there");
  EXPECT_NEAR(logOdds(object(1).existence), logOdds(before) - 2.5, 1e-9);
  EXPECT_THAT(run({"--list"}), HasSubstr("not_there  1"));
  EXPECT_THAT(run({"--list"}), HasSubstr("2.5 nats  Ada"));
  EXPECT_THAT(run({"--withdraw", "1"}), HasSubstr("(withdrawn)"));
  EXPECT_EQ(object(1).existence, before);
  EXPECT_EQ(run({"--list"}), "");
}

TEST_F(CorrectCommand, TheListOfAMapThatIsSentToAServerIsReadOnly) {
  (void)run({"1", "--not-there"});
  using map_store::Connection;
  ASSERT_TRUE(Connection::open(path_, Connection::Mode::kReadWriteCreate)
                  .and_then([](const Connection& file) {
                    return file.execute("CREATE TABLE outbox(id INTEGER)");
                  })
                  .has_value());
  EXPECT_THAT(run({"--list"}), HasSubstr("not_there  1"));
  EXPECT_THAT(refusal({"2", "--not-there"}, ExitCode::kUsage), HasSubstr("is sent to a server"));
}

TEST_F(CorrectCommand, EachKindHasAnOption) {
  (void)run({"1", "--class", "car"});
  (void)run({"1", "--different-from", "2"});
  (void)run({"2", "--same-as", "1"});
  const std::string list = run({"--list"});
  EXPECT_THAT(list, HasSubstr("1  class      1             car"));
  EXPECT_THAT(list, HasSubstr("2  different  1 and 2"));
  EXPECT_THAT(list, HasSubstr("3  same       2 and 1"));
}

TEST_F(CorrectCommand, AnEmptyOrZeroValueIsNotAnotherStatement) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"1", "--class", ""},
                                                {"1", "--same-as", "0"},
                                                {"1", "--withdraw", "0"},
                                                {"0", "--not-there"},
                                                {"1", "--not-there", "--nats", "0"},
                                                {"1", "--not-there", "--author", "\xff"}}) {
    EXPECT_THROW(run(words), CLI::ParseError) << words[1];
  }
  EXPECT_EQ(run({"--list"}), "");
}

TEST_F(CorrectCommand, RefusalsNameCauseAndFix) {
  EXPECT_THAT(refusal({"7", "--not-there"}, ExitCode::kFailure), HasSubstr("no object 7"));
  EXPECT_THAT(refusal({"1", "--same-as", "1"}, ExitCode::kFailure), HasSubstr("given twice"));
  EXPECT_THAT(refusal({"1", "--class", "truck"}, ExitCode::kFailure),
              HasSubstr("its classes are: car"));
  EXPECT_THAT(refusal({"--not-there"}, ExitCode::kUsage), HasSubstr("give the ID"));
  EXPECT_THROW((void)run({"1", "--not-there", "--class", "car"}), CLI::ParseError);
  const map_store::MapDatabase running({path_});
  EXPECT_THAT(refusal({"1", "--not-there"}, ExitCode::kUnavailable),
              HasSubstr("is in use by another program; leave out --db or --map"));
}

}  // namespace
}  // namespace perdure::tools

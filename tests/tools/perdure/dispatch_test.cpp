// Tests that `perdure` runs the executable of a subcommand in its own process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/base/errors.h"
#include "common/base/subprocess.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

class Dispatch : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PERDURE_TOOL") == nullptr) GTEST_SKIP() << "run by ctest";
    perdure_ = std::getenv("PERDURE_TOOL");
  }

  ProgramAnswer answerTo(std::vector<std::string> words) const {
    words.insert(words.begin(), perdure_);
    return runProgram({.command = words});
  }

  std::string perdure_;
};

constexpr int kUsage = static_cast<int>(ExitCode::kUsage);

TEST_F(Dispatch, EverySubcommandInTheListHasAnExecutableWithItsSummary) {
  const std::string help = answerTo({"--help"}).output;
  for (const auto& [name, summary] : commands()) {
    EXPECT_THAT(help, HasSubstr(summary));
    const ProgramAnswer own = answerTo({"help", name});
    EXPECT_EQ(own.status, 0) << name;
    EXPECT_THAT(own.output, AllOf(HasSubstr(summary), HasSubstr(std::string("perdure ") + name)));
    EXPECT_EQ(answerTo({name, "--help"}).output, own.output);
  }
}

TEST_F(Dispatch, AnUnknownSubcommandIsRefusedWithTheNearestName) {
  const ProgramAnswer near = answerTo({"pipelin"});
  EXPECT_EQ(near.status, kUsage);
  EXPECT_THAT(near.output, HasSubstr("did you mean pipeline?"));
  const ProgramAnswer far = answerTo({"zzzzzzzzzz"});
  EXPECT_EQ(far.status, kUsage);
  EXPECT_THAT(far.output, AllOf(HasSubstr("zzzzzzzzzz"), Not(HasSubstr("did you mean"))));
  EXPECT_EQ(answerTo({}).status, kUsage);
}

TEST_F(Dispatch, ExitStatusesAreThoseOfTheSubcommand) {
  EXPECT_EQ(answerTo({"map"}).status, kUsage);
  EXPECT_EQ(answerTo({"map", "list", "--db", "/nonexistent/map.sqlite"}).status,
            static_cast<int>(ExitCode::kUnavailable));
}

/// Whether the output is buffered until the end, or written (and refused) line by line.
TEST_F(Dispatch, OutputThatCannotBeWrittenIsRefusedWithItsReasonAndTheFix) {
  const std::string poses = (fs::path(testing::TempDir()) / "dispatch.tum").string();
  std::ofstream file(poses);
  for (int i = 0; i < 30; ++i) file << i << ".0 " << i << " 0 0 0 0 0 1\n";
  file.close();
  for (const std::string buffer : {"-oL", "-o100000"}) {
    const ProgramAnswer answer =
        runProgram({.command = {"sh", "-c",
                                "stdbuf " + buffer + " '" + perdure_ + "' evaluate trajectory '" +
                                    poses + "' --truth '" + poses + "' > /dev/full"}});
    EXPECT_EQ(answer.status, static_cast<int>(ExitCode::kInputOutput)) << buffer;
    EXPECT_THAT(answer.output, AllOf(HasSubstr("No space left on device"),
                                     HasSubstr("free space, or send it elsewhere")));
  }
}

TEST_F(Dispatch, TheSubcommandTakesThePlaceOfTheProcessAndGetsItsSignals) {
  Subprocess process({.command = {perdure_, "simulate", "--scene", "street", "--out",
                                  (fs::path(testing::TempDir()) / "dispatch").string()}});
  const fs::path exe = fs::path("/proc") / std::to_string(process.pid()) / "exe";
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (fs::read_symlink(exe).filename() != "simulate" && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_THAT(fs::read_symlink(exe).string(), EndsWith("libexec/perdure/simulate"));
  process.signal(SIGKILL);
  EXPECT_EQ(process.waitForEnd(), 128 + SIGKILL);
}

TEST_F(Dispatch, AMissingExecutableIsNamedWithWhatBuildsIt) {
  const fs::path bin = fs::path(testing::TempDir()) / "lonely" / "bin";
  fs::create_directories(bin);
  fs::copy_file(perdure_, bin / "perdure", fs::copy_options::overwrite_existing);
  const ProgramAnswer answer = runProgram({.command = {(bin / "perdure").string(), "topics"}});
  EXPECT_EQ(answer.status, static_cast<int>(ExitCode::kUnavailable));
  EXPECT_THAT(answer.output, AllOf(HasSubstr("lonely/libexec/perdure/topics"),
                                   HasSubstr("--target perdure-command-topics")));
}

}  // namespace
}  // namespace perdure::tools

#include "common/base/subprocess.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

#include "common/base/errors.h"

namespace perdure {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using namespace std::chrono_literals;

std::string refusalOf(const ProgramOptions& options) {
  try {
    const Subprocess process(options);
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
    return error.what();
  }
  return {};
}

std::string contentsOf(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Subprocess, PassesItsArgumentsAsTheyAre) {
  const auto answer = runProgram({.command = {"printf", "%s|", "a b", "'", "$HOME", "*", ""}});
  EXPECT_EQ(answer.status, 0);
  EXPECT_EQ(answer.output, "a b|'|$HOME|*||");
}

TEST(Subprocess, KeepsBothStreamsInTheirOrder) {
  const auto answer = runProgram({.command = {"sh", "-c", "echo a; echo b >&2; echo c"}});
  EXPECT_EQ(answer.output, "a\nb\nc\n");
}

TEST(Subprocess, KeepsMoreThanAPipeHolds) {
  const auto answer = runProgram({.command = {"head", "-c", "1000000", "/dev/zero"}});
  EXPECT_EQ(answer.output.size(), 1'000'000u);
}

TEST(Subprocess, TellsTheExitStatusOrTheSignal) {
  EXPECT_EQ(runProgram({.command = {"sh", "-c", "exit 78"}}).status, 78);
  EXPECT_EQ(runProgram({.command = {"sh", "-c", "kill -9 $$"}}).status, 128 + SIGKILL);
}

TEST(Subprocess, OfWhatIsMissingOrNoProgramSaysSo) {
  EXPECT_EQ(refusalOf({.command = {"no-such-program"}}),
            "no-such-program cannot be started: it is not in PATH");
  EXPECT_EQ(refusalOf({.command = {"/nowhere/x"}}),
            "/nowhere/x cannot be started: No such file or directory");
  EXPECT_THAT(refusalOf({.command = {"/etc/passwd"}}), EndsWith("Permission denied"));
  EXPECT_THAT(refusalOf({.command = {"true"}, .folder = "/nowhere"}), HasSubstr("No such file"));
  EXPECT_THAT(refusalOf({.command = {"true"}, .log = "/nowhere/log"}),
              HasSubstr("/nowhere/log cannot be written"));
}

TEST(Subprocess, HasItsFolderAndItsVariablesBesideThoseOfItsParent) {
  setenv("PERDURE_TEST_KEPT", "kept", 1);
  setenv("PERDURE_TEST_CHANGED", "old", 1);
  const auto answer =
      runProgram({.command = {"sh", "-c", "pwd; echo $PERDURE_TEST_KEPT $PERDURE_TEST_CHANGED"},
                  .environment = {{"PERDURE_TEST_CHANGED", "new"}},
                  .folder = "/"});
  EXPECT_EQ(answer.output, "/\nkept new\n");
}

TEST(Subprocess, AppendsWhatItPrintsToItsLog) {
  const auto log = std::filesystem::path(testing::TempDir()) /
                   ("perdure_subprocess_" + std::to_string(getpid()));
  for (const char* word : {"one", "two"}) {
    Subprocess process({.command = {"echo", word}, .log = log});
    EXPECT_EQ(process.waitForEnd(), 0);
  }
  EXPECT_EQ(contentsOf(log), "one\ntwo\n");
  std::filesystem::remove(log);
}

TEST(Subprocess, IsKilledWhereItTakesTooLong) {
  const auto silent = runProgram({.command = {"sleep", "100"}}, 50ms);
  EXPECT_TRUE(silent.too_late);
  EXPECT_EQ(silent.status, 128 + SIGKILL);
  // The program has closed its output but still runs.
  const auto mute = runProgram({.command = {"sh", "-c", "exec sleep 100 > /dev/null 2>&1"}}, 50ms);
  EXPECT_TRUE(mute.too_late);
}

TEST(Subprocess, ASignalDoesNotExtendTheTimeLimit) {
  struct sigaction noted {};
  noted.sa_handler = [](int) {};
  sigaction(SIGUSR1, &noted, nullptr);
  const pthread_t self = pthread_self();
  std::thread other([self] {
    std::this_thread::sleep_for(50ms);
    pthread_kill(self, SIGUSR1);
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(runProgram({.command = {"sleep", "10"}}, 200ms).too_late);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
  other.join();
}

TEST(Subprocess, WaitsNoLongerThanItIsTold) {
  Subprocess process({.command = {"sleep", "100"}});
  EXPECT_FALSE(process.ended());
  EXPECT_FALSE(process.wait(20ms));
  process.signal(SIGINT);
  EXPECT_EQ(process.wait(10s), 128 + SIGINT);
}

TEST(Subprocess, StopsByAskingAndThenByForce) {
  Subprocess polite({.command = {"sleep", "100"}});
  polite.stop(10s);
  EXPECT_EQ(polite.ended(), 128 + SIGTERM);
  const std::string deaf_file = testing::TempDir() + "perdure_deaf_" + std::to_string(getpid());
  Subprocess deaf({.command = {"sh", "-c", "trap '' TERM; : > \"$0\"; while :; do sleep 0.1; done",
                               deaf_file}});
  // Waits until the program ignores SIGTERM.
  while (!std::filesystem::exists(deaf_file)) std::this_thread::sleep_for(1ms);
  deaf.stop(50ms);
  EXPECT_EQ(deaf.ended(), 128 + SIGKILL);
  std::filesystem::remove(deaf_file);
}

TEST(Subprocess, EndsWithItsScopeUnlessItIsLeftAlone) {
  pid_t killed = 0, left = 0;
  {
    const Subprocess process({.command = {"sleep", "100"}});
    killed = process.pid();
    Subprocess other({.command = {"sleep", "100"}});
    other.leaveAlone();
    left = other.pid();
  }
  EXPECT_NE(kill(killed, 0), 0);
  EXPECT_EQ(kill(left, 0), 0);
  kill(left, SIGKILL);
}

TEST(Subprocess, OfASessionOfItsOwnReadsNothing) {
  const auto answer =
      runProgram({.command = {"sh", "-c", "cat; [ $(ps -o sid= -p $$) = $$ ] && echo own"},
                  .own_session = true});
  EXPECT_EQ(answer.output, "own\n");
}

TEST(FindProgram, LooksIntoPathForBareNamesOnly) {
  EXPECT_TRUE(findProgram("sh").has_value());
  EXPECT_FALSE(findProgram("no-such-program").has_value());
  EXPECT_EQ(findProgram("./here"), "./here");
}

}  // namespace
}  // namespace perdure

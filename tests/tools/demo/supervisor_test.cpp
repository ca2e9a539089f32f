#include "tools/demo/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>

#include "common/base/errors.h"
#include "tools/base/files.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Supervises shell programs, in a folder with an unusual name.
class Supervision : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }

  std::unique_ptr<Supervisor> start(const std::string& script) {
    const std::vector<ServicePlan> services = {
        {"worker", {"/bin/sh", "-c", script}, (folder_ / "worker.log").string()}};
    return std::make_unique<Supervisor>(services, folder_);
  }

  static bool eventually(const std::function<bool()>& so) {
    for (int i = 0; i < 400; ++i) {
      if (so()) return true;
      std::this_thread::sleep_for(50ms);
    }
    return false;
  }

  std::string refusal(Supervisor& supervisor) {
    try {
      (void)eventually([&] {
        supervisor.watch();
        return false;
      });
    } catch (const StartupError& error) {
      status_ = static_cast<int>(error.code());
      return error.what();
    }
    return "none";
  }

  const TemporaryFolder place_{fs::temp_directory_path() / "perdure-sv-",
                               [](const std::string& name) { FAIL() << name; }};
  const fs::path folder_ = place_.path() / "50% off ;a #b";
  int status_ = 0;
};

TEST_F(Supervision, StartsAKilledProgramAgainHoweverOften) {
  const auto supervisor = start("echo $$ > pid; exec sleep 100");
  pid_t last = 0;
  for (int round = 1; round <= 4; ++round) {
    pid_t pid = 0;
    ASSERT_TRUE(eventually([&] {
      supervisor->watch();
      std::ifstream(folder_ / "pid") >> pid;
      return pid > 1 && pid != last && supervisor->starts("worker") == round;
    })) << round;
    // the service runs for over a second, so its end is no failed start
    std::this_thread::sleep_for(1050ms);
    kill(pid, SIGKILL);
    last = pid;
  }
}

TEST_F(Supervision, RefusesAProgramThatSaysThatItCannotStart) {
  const auto supervisor = start("echo 'key: 3 is not > 5; raise it' >&2; exit 78");
  EXPECT_THAT(refusal(*supervisor),
              HasSubstr("worker does not start: key: 3 is not > 5; raise it"));
  EXPECT_EQ(status_, 78);
  EXPECT_EQ(supervisor->starts("worker"), 1);
}

TEST_F(Supervision, RefusesAProgramThatEndsInItsFirstSecondFiveTimes) {
  const auto supervisor = start("exit 3");
  EXPECT_THAT(refusal(*supervisor), HasSubstr("it ends in its first second (its log: "));
  EXPECT_EQ(supervisor->starts("worker"), 5);
}

TEST_F(Supervision, RefusesAProgramThatDoesNotExist) {
  const std::vector<ServicePlan> services = {{"worker", {"/none"}, (folder_ / "log").string()}};
  EXPECT_THROW(Supervisor(services, folder_), StartupError);
}

TEST_F(Supervision, StopsAProgramWhenToldAndDoesNotStartItAgain) {
  const auto supervisor = start("trap 'exit 1' TERM; while :; do sleep 0.1; done");
  std::this_thread::sleep_for(300ms);
  ASSERT_TRUE(supervisor->runs("worker"));
  supervisor->stop("worker");
  EXPECT_TRUE(eventually([&] { return !supervisor->runs("worker"); }));
  supervisor->watch();
  EXPECT_EQ(supervisor->starts("worker"), 1);
}

TEST_F(Supervision, EndsItsProgramsAtItsOwnEnd) {
  pid_t pid = 0;
  {
    const auto supervisor = start("echo $$ > pid; exec sleep 100");
    ASSERT_TRUE(eventually([&] {
      std::ifstream(folder_ / "pid") >> pid;
      return pid > 1;
    }));
  }
  EXPECT_NE(kill(pid, 0), 0);
}

}  // namespace
}  // namespace perdure::tools

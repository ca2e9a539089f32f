#include "tools/demo/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "common/base/errors.h"
#include "tools/demo/plan.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// The answers of supervisord 4.2.5.
constexpr char kAnswer[] = R"xml(<?xml version='1.0'?>
<methodResponse>
<params>
<param>
<value><array><data>
<value><struct>
<member>
<name>name</name>
<value><string>vio</string></value>
</member>
<member>
<name>exitstatus</name>
<value><int>0</int></value>
</member>
<member>
<name>statename</name>
<value><string>BACKOFF</string></value>
</member>
<member>
<name>spawnerr</name>
<value><string>Exited too quickly</string></value>
</member>
</struct></value>
<value><struct>
<member>
<name>name</name>
<value><string>capture</string></value>
</member>
<member>
<name>exitstatus</name>
<value><int>0</int></value>
</member>
<member>
<name>statename</name>
<value><string>RUNNING</string></value>
</member>
<member>
<name>spawnerr</name>
<value><string></string></value>
</member>
</struct></value>
</data></array></value>
</param>
</params>
</methodResponse>)xml";

TEST(SupervisorAnswers, GiveStateAndSpawnErrorOfEachProcess) {
  const auto states = readProcessInfo(kAnswer);
  ASSERT_EQ(states.size(), 2u);
  EXPECT_EQ(states.at("vio").state, "BACKOFF");
  EXPECT_EQ(states.at("vio").spawn_error, "Exited too quickly");
  EXPECT_EQ(states.at("capture").state, "RUNNING");
  EXPECT_TRUE(states.at("capture").spawn_error.empty());
}

TEST(SupervisorAnswers, GiveNothingForWhatIsCutShort) {
  const std::string whole = kAnswer;
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    EXPECT_LE(readProcessInfo(whole.substr(0, size)).size(), 2u);
  }
  EXPECT_TRUE(readProcessInfo("<struct>").empty());
}

TEST(SupervisorAnswers, CountStartsInTheLog) {
  const auto counts = countSpawns(
      "2026-01-01 INFO spawned: 'vio' with pid 10\n2026-01-01 INFO success: vio entered\n"
      "2026-01-01 INFO spawned: 'capture' with pid 11\n2026-01-01 INFO spawned: 'vio' with pid 12");
  EXPECT_EQ(counts.at("vio"), 2);
  EXPECT_EQ(counts.at("capture"), 1);
}

TEST(SupervisorAnswers, GiveTheLastExitStatusFromTheLog) {
  const auto exits = lastExits(
      "WARN exited: vio (exit status 69; not expected)\nWARN exited: vio (exit status 78; not "
      "expected)\nWARN exited: capture (terminated by SIGKILL; not expected)");
  EXPECT_EQ(exits.at("vio"), 78);
  EXPECT_FALSE(exits.contains("capture"));
}

TEST(SupervisorAnswers, GiveWhyItEndedAtOnce) {
  EXPECT_EQ(complaintIn("Error: Format string '50% off' is badly formatted\nFor help, use -h\n"),
            "Error: Format string '50% off' is badly formatted");
  EXPECT_EQ(complaintIn("Traceback\nOSError: no room\n\n"), "OSError: no room");
  EXPECT_EQ(complaintIn(""), "");
}

/// Runs the real supervisord with shell programs.
class Supervision : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!findProgram("supervisord")) {
      GTEST_SKIP() << "supervisord is not installed: deploy/install --runtime";
    }
    std::string name = (fs::temp_directory_path() / "perdure-sv-XXXXXX").string();
    place_ = mkdtemp(name.data());
    folders_.out = place_ / "50% off ;a #b";
    fs::create_directories(folders_.out);
    folders_.run = folders_.state = folders_.out;
  }
  void TearDown() override {
    if (!place_.empty()) fs::remove_all(place_);
  }

  std::unique_ptr<Supervisor> start(const std::string& script) {
    const std::vector<ServicePlan> services = {
        {"worker", {"/bin/sh", "-c", script}, (folders_.out / "worker.log").string()}};
    const std::string socket = (folders_.out / "s").string();
    const std::string config = (folders_.out / "supervisord.conf").string();
    std::ofstream(config) << supervisorConfig(services, folders_, socket, folders_.out);
    return std::make_unique<Supervisor>(config, socket, (folders_.out / "out").string());
  }

  std::string log() {
    std::ifstream file(folders_.out / "supervisord.log");
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static bool eventually(const std::function<bool()>& so) {
    for (int i = 0; i < 400; ++i) {
      if (so()) return true;
      std::this_thread::sleep_for(50ms);
    }
    return false;
  }

  fs::path place_;
  DemoFolders folders_;
};

TEST_F(Supervision, StartsAKilledProgramAgainHoweverOften) {
  const std::string pid_file = (folders_.out / "pid").string();
  const auto supervisor = start("echo $$ > '" + pid_file + "'; exec sleep 100");
  pid_t last = 0;
  for (int round = 1; round <= 5; ++round) {
    pid_t pid = 0;
    ASSERT_TRUE(eventually([&] {
      const auto states = supervisor->states();
      std::ifstream(pid_file) >> pid;
      // The state alone may be older than the kill.
      return states && states->at("worker").state == "RUNNING" && pid > 1 && pid != last &&
             countSpawns(log())["worker"] == round;
    })) << log();
    kill(pid, SIGKILL);
    last = pid;
  }
}

TEST_F(Supervision, TellsOfAProgramThatCannotStart) {
  const auto failing = start("exit 78");
  EXPECT_TRUE(eventually([&] {
    const auto states = failing->states();
    return states && states->at("worker").state == "BACKOFF" && lastExits(log())["worker"] == 78;
  }));
}

TEST_F(Supervision, ThatEndsAtOnceGivesItsOwnWords) {
  const std::string config = (folders_.out / "wrong.conf").string();
  std::ofstream(config) << "[supervisord]\nlogfile=/tmp/%(nothing)s\n";
  try {
    Supervisor(config, (folders_.out / "s").string(), (folders_.out / "out").string());
    FAIL() << "it was not refused";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("ended at once: Error: "));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("; see "));
  }
}

TEST_F(Supervision, StopsAProgramWhenTold) {
  const auto supervisor = start("trap 'exit 0' TERM; while :; do sleep 0.1; done");
  ASSERT_TRUE(eventually([&] {
    const auto states = supervisor->states();
    return states && states->at("worker").state == "RUNNING";
  }));
  supervisor->stop("worker");
  EXPECT_TRUE(eventually([&] {
    const auto states = supervisor->states();
    return states && states->at("worker").ended();
  }));
}

}  // namespace
}  // namespace perdure::tools

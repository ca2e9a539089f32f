// The bus between processes over loopback: latching, failover after kill -9, late joiners.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <set>

#include "common/bus/wait_loop.h"
#include "tests/common/bus/run_until.h"

extern char** environ;

namespace perdure::bus {
namespace {

/// A child process; killed at the end at the latest.
class Peer {
 public:
  Peer(const std::string& what, const std::string& argument) {
    std::string program = std::getenv("PERDURE_BUS_PEER");
    std::array<char*, 4> argv{program.data(), const_cast<char*>(what.c_str()),
                              const_cast<char*>(argument.c_str()), nullptr};
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    EXPECT_EQ(posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    output_ = ends[0];
  }
  ~Peer() {
    kill9();
    close(output_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// Waits for its first line.
  void waitForLine() const {
    char c = 0;
    while (read(output_, &c, 1) == 1 && c != '\n') {
    }
  }
  void kill9() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
  int output_ = -1;
};

class Processes : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PERDURE_BUS_PEER") == nullptr) GTEST_SKIP() << "run by ctest";
  }
  Domain domain{Options{}};
  Participant participant{domain, "test"};
  WaitLoop loop{participant};
};

TEST_F(Processes, ALateJoinerGetsTheLatchedTilesButNotTheDisposedOne) {
  Peer peer("tiles", "50");
  peer.waitForLine();
  Reader<MapTile> reader(participant, topics::kMap);
  std::set<int> tiles;
  int gone = 0;
  loop.on(
      reader, [&](const MapTile& m) { tiles.insert(m.x); }, [&](const MapTile&) { ++gone; });
  EXPECT_TRUE(runUntil(loop, [&] { return tiles.size() == 49; }));
  EXPECT_FALSE(tiles.contains(0));
  EXPECT_EQ(gone, 0);
}

TEST_F(Processes, ALateJoinerGetsTheNewest512InertialSamplesInOrder) {
  Peer peer("imu", "2000");
  peer.waitForLine();
  Reader<ImuSample> reader(participant, topics::kImu);
  std::vector<std::uint64_t> got;
  loop.on(reader, [&](const ImuSample& m) { got.push_back(m.sequence); });
  EXPECT_TRUE(runUntil(loop, [&] { return got.size() == 512; }));
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.front(), 1488u);
  EXPECT_EQ(got.back(), 1999u);
  EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
}

TEST_F(Processes, TheStandbyIsHeardAfterTheOwnerIsKilled) {
  Reader<Detections> reader(participant, topics::kDetections);
  InstanceId last = 0;
  loop.on(reader, [&](const Detections& m) { last = m.instance; });
  Peer standby("detections", "1");
  ASSERT_TRUE(runUntil(loop, [&] { return last == 1; }));
  Peer owner("detections", "2");
  ASSERT_TRUE(runUntil(loop, [&] { return last == 2; }));
  owner.kill9();
  EXPECT_TRUE(runUntil(loop, [&] { return last == 1; }));
}

}  // namespace
}  // namespace perdure::bus

// The bus between processes over loopback: latching, failover after kill -9, late joiners.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <set>
#include <thread>

#include "common/base/subprocess.h"
#include "common/bus/wait_loop.h"
#include "tests/common/bus/run_until.h"

namespace perdure::bus {
namespace {

/// Waits until a process has printed its first line.
bool saysALine(const std::string& log) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (std::chrono::steady_clock::now() < end) {
    std::ifstream file(log);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.find('\n') != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

class Processes : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("PERDURE_BUS_PEER") == nullptr) GTEST_SKIP() << "run by ctest";
  }
  ~Processes() override { std::remove(log_.c_str()); }
  /// Starts a peer, which is killed at the end of its scope at the latest.
  ProgramOptions peer(const std::string& what, const std::string& argument) const {
    return {.command = {std::getenv("PERDURE_BUS_PEER"), what, argument}, .log = log_};
  }
  const std::string log_ = testing::TempDir() + "perdure_peer_" + std::to_string(getpid());
  Domain domain{Options{}};
  Participant participant{domain, "test"};
  WaitLoop loop{participant};
};

TEST_F(Processes, ALateJoinerGetsTheLatchedTilesButNotTheDisposedOne) {
  const Subprocess writer(peer("tiles", "50"));
  ASSERT_TRUE(saysALine(log_));
  Reader<MapTile> reader(participant, kTopic<MapTile>);
  std::set<int> tiles;
  int gone = 0;
  loop.on(
      reader, [&](const MapTile& m) { tiles.insert(m.x); }, [&](const MapTile&) { ++gone; });
  EXPECT_TRUE(runUntil(loop, [&] { return tiles.size() == 49; }));
  EXPECT_FALSE(tiles.contains(0));
  EXPECT_EQ(gone, 0);
}

TEST_F(Processes, ALateJoinerGetsTheNewest512InertialSamplesInOrder) {
  const Subprocess writer(peer("imu", "2000"));
  ASSERT_TRUE(saysALine(log_));
  Reader<ImuSample> reader(participant, kTopic<ImuSample>);
  std::vector<std::uint64_t> got;
  loop.on(reader, [&](const ImuSample& m) { got.push_back(m.sequence); });
  EXPECT_TRUE(runUntil(loop, [&] { return got.size() == 512; }));
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.front(), 1488u);
  EXPECT_EQ(got.back(), 1999u);
  EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
}

TEST_F(Processes, AReaderThatStopsForAWhileGetsAllInertialSamples) {
  constexpr std::size_t kSamples = 4000;  // 10 s at 400 Hz
  Writer<ImuSample> writer(participant, kTopic<ImuSample>);
  const Subprocess reader(peer("read imu", std::to_string(kSamples)));
  ASSERT_TRUE(saysALine(log_));
  ASSERT_TRUE(runUntil(loop, [&] { return writer.matched() == 1; }));
  reader.signal(SIGSTOP);
  for (std::size_t i = 0; i < kSamples; ++i) (void)writer.write(ImuSample{});
  reader.signal(SIGCONT);
  EXPECT_TRUE(runUntil(loop, [&] {
    std::ifstream file(log_);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return text.find("has all") != std::string::npos;
  }));
}

TEST_F(Processes, TheStandbyIsHeardAfterTheOwnerIsKilled) {
  Reader<Detections> reader(participant, kTopic<Detections>);
  InstanceId last = 0;
  loop.on(reader, [&](const Detections& m) { last = m.instance; });
  const Subprocess standby(peer("detections", "1"));
  ASSERT_TRUE(runUntil(loop, [&] { return last == 1; }));
  const Subprocess owner(peer("detections", "2"));
  ASSERT_TRUE(runUntil(loop, [&] { return last == 2; }));
  owner.signal(SIGKILL);
  EXPECT_TRUE(runUntil(loop, [&] { return last == 1; }));
}

}  // namespace
}  // namespace perdure::bus

// Images through shared memory: with RouDi, without RouDi, and with RouDi killed and started again.
// All participants are other processes, with their own /tmp and /dev/shm.
#include "common/bus/shared_memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <regex>

#include "common/bus/domain.h"
#include "tests/process/support.h"

namespace perdure::bus {
namespace {

using namespace std::chrono_literals;
using test::Child;
using test::eventually;

/// Returns the number after a word in a peer's output, for example in "got 60 wrong 0 …".
double said(const Child& peer, const std::string& word) {
  std::smatch match;
  const std::string log = peer.log();
  const std::regex pattern("(?:^|\\s)" + word + " ([0-9.]+)");
  return std::regex_search(log, match, pattern) ? std::stod(match[1]) : -1.0;
}

bool says(const Child& peer, const std::string& text) {
  return eventually(10s, [&] { return peer.log().find(text) != std::string::npos; });
}

class SharedMemory : public testing::Test {
 protected:
  static constexpr int kFrames = 40, kSide = 640, kMegabytes = 4;

  void SetUp() override {
    if (std::getenv("PERDURE_FRAME_PEER") == nullptr) GTEST_SKIP() << "run by ctest";
    if (!findProgram("iox-roudi")) {
      GTEST_SKIP() << "iox-roudi is not installed: deploy/install --runtime";
    }
    test::ownNetwork();
    if (!test::ownFiles()) {
      GTEST_SKIP()
          << "no /tmp of one's own: mount is not allowed here, or the programs are below /tmp";
    }
    folder_ = std::make_unique<test::Folder>();
  }

  /// Returns once processes can connect.
  std::unique_ptr<Child> roudi(const std::string& chunks = "size = 4194304\ncount = 24") {
    const std::string config = folder_->file("roudi.toml"), log = nextLog();
    std::ofstream(config) << "[general]\nversion = 1\n[[segment]]\n[[segment.mempool]]\n"
                          << chunks << "\n";
    auto child = std::make_unique<Child>(
        std::vector<std::string>{"iox-roudi", "-m", "off", "-c", config}, log);
    EXPECT_TRUE(says(*child, "RouDi is ready")) << child->log();
    return child;
  }
  std::unique_ptr<Child> peer(const std::string& what, int count = kFrames, int side = kSide,
                              int mb = kMegabytes, int hold = 1) {
    auto child = std::make_unique<Child>(
        std::vector<std::string>{std::getenv("PERDURE_FRAME_PEER"), what, std::to_string(count),
                                 std::to_string(side), std::to_string(mb), std::to_string(hold)},
        nextLog());
    EXPECT_TRUE(what == "write" || says(*child, "ready")) << child->log();
    return child;
  }
  static void expectEnd(Child& peer) { EXPECT_EQ(peer.wait(30s), 0) << peer.log(); }
  static void print(const char* what, const Child& peer) {
    const std::string log = peer.log();
    const auto at = std::max(log.rfind("\ngot "), log.rfind("\nwrote "));
    if (at != std::string::npos && at < log.size()) {
      std::printf("%s: %s", what, log.substr(at + 1, log.find('\n', at + 1) - at).c_str());
    }
  }

 private:
  std::string nextLog() { return folder_->file("log" + std::to_string(logs_++)); }

  std::unique_ptr<test::Folder> folder_;
  int logs_ = 0;
};

using LongSharedMemory = SharedMemory;

TEST_F(SharedMemory, AnImageIsCopiedOnceAndLookedAtWhereItLies) {
  const auto broker = roudi();
  auto first = peer("look"), second = peer("look", kFrames, kSide, kMegabytes, 8);
  auto writer = peer("write");
  for (Child* child : {first.get(), second.get(), writer.get()}) expectEnd(*child);
  for (const Child* reader : {first.get(), second.get()}) {
    EXPECT_EQ(said(*reader, "got"), kFrames) << reader->log();
    EXPECT_EQ(said(*reader, "shared"), kFrames);
    EXPECT_EQ(said(*reader, "in_place"), kFrames) << "pixels outside of shared memory";
    EXPECT_EQ(said(*reader, "wrong"), 0) << "another frame's pixels, while it was held";
    EXPECT_LT(said(*reader, "copies"), 0.1);
    print("through shared memory", *reader);
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_NEAR(said(*writer, "copies"), 1.0, 0.05) << writer->log();
#endif
  print("through shared memory", *writer);
}

TEST_F(SharedMemory, WithoutRouDiImagesGoOverTheNetworkAtOnceAndItIsTold) {
  const auto began = std::chrono::steady_clock::now();
  auto reader = peer("look");
  auto writer = peer("write");
  expectEnd(*reader), expectEnd(*writer);
  EXPECT_LT(std::chrono::steady_clock::now() - began, 20s) << "Cyclone waits a minute for RouDi";
  EXPECT_EQ(said(*reader, "got"), kFrames) << reader->log();
  EXPECT_EQ(said(*reader, "shared"), 0);
  EXPECT_LT(said(*reader, "copies"), 1.1) << "put together from the network, and no more";
  EXPECT_THAT(reader->log(), testing::HasSubstr("no shared memory: RouDi does not answer"));
  print("over the network", *reader);
  print("over the network", *writer);
}

TEST_F(LongSharedMemory, SomeProcessesWithoutItHearTheSameImages) {
  const auto broker = roudi();
  auto sharing = peer("look"), apart = peer("look", kFrames, kSide, 0);
  auto writer = peer("write");
  for (Child* child : {sharing.get(), apart.get(), writer.get()}) expectEnd(*child);
  EXPECT_EQ(said(*sharing, "shared"), kFrames) << sharing->log();
  EXPECT_EQ(said(*apart, "got"), kFrames) << apart->log();
  EXPECT_EQ(said(*apart, "shared"), 0);
}

TEST_F(SharedMemory, RouDiIsKilledAndStartedAnewAndNoProcessLosesAFrame) {
  auto broker = roudi();
  constexpr int kLong = 240;  // 4 s
  auto old_reader = peer("look", kLong);
  auto writer = peer("write", kLong);
  ASSERT_TRUE(says(*writer, "ready"));
  std::this_thread::sleep_for(300ms);
  broker->signal(SIGKILL);
  EXPECT_EQ(broker->wait(5s), 128 + SIGKILL);
  auto between = peer("look", 30);  // this reader starts while RouDi is not running
  broker = roudi();
  auto after = peer("look", 30);
  for (Child* child : {between.get(), after.get(), old_reader.get(), writer.get()}) {
    expectEnd(*child);
  }
  EXPECT_EQ(said(*old_reader, "got"), kLong) << "they go on in the memory that they have";
  EXPECT_EQ(said(*old_reader, "gaps"), 0);
  EXPECT_EQ(said(*old_reader, "shared"), kLong);
  for (const Child* late : {between.get(), after.get()}) {
    EXPECT_EQ(said(*late, "got"), 30) << late->log();
    EXPECT_EQ(said(*late, "gaps"), 0);
    EXPECT_EQ(said(*late, "shared"), 0) << "of another RouDi: over the network";
  }
  EXPECT_EQ(said(*writer, "failed"), 0) << writer->log();
  // A process that starts after all of them shares memory again.
  auto new_reader = peer("look", 30);
  auto new_writer = peer("write", 30);
  expectEnd(*new_reader), expectEnd(*new_writer);
  EXPECT_EQ(said(*new_reader, "shared"), 30) << new_reader->log();
}

/// iceoryx aborts a process that requests a chunk larger than those of all pools.
TEST_F(LongSharedMemory, AnImageThatIsTooLargeGoesOverTheNetwork) {
  const auto broker = roudi();
  auto reader = peer("look", 10, 2100);
  auto writer = peer("write", 10, 2100);  // 4.4 million bytes
  expectEnd(*reader), expectEnd(*writer);
  EXPECT_EQ(said(*writer, "too_large"), 1) << writer->log();
  EXPECT_GE(said(*reader, "got"), 9) << "one may be lost at the change" << reader->log();
  EXPECT_EQ(said(*reader, "shared"), 0);
}

/// A reader that holds more images than there are chunks.
TEST_F(LongSharedMemory, WhereChunksAreUsedUpImagesGoOverTheNetwork) {
  const auto broker = roudi("size = 1048576\ncount = 8");
  auto reader = peer("look", 40, kSide, 1, 100);
  auto writer = peer("write", 40, kSide, 1);
  expectEnd(*reader), expectEnd(*writer);
  EXPECT_EQ(said(*writer, "used_up"), 1) << writer->log();
  EXPECT_EQ(said(*writer, "failed"), 0);
  EXPECT_GE(said(*reader, "got"), 39) << "one may be lost at the change" << reader->log();
  EXPECT_EQ(said(*reader, "wrong"), 0);
  EXPECT_GT(said(*reader, "shared"), 0);
  EXPECT_LT(said(*reader, "shared"), 9);
}

}  // namespace
}  // namespace perdure::bus

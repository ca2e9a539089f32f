// Tests two real inference processes on the bus: the owner is killed, stopped, and terminated.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <memory>

#include "common/bus/once.h"
#include "tests/process/support.h"
#include "tests/services/inference/tiny_model.h"
#include "tests/services/run_until.h"

namespace perdure::inference {
namespace {

using namespace std::chrono_literals;
using test::Child;
using test::runUntil;

constexpr auto kPeriod = 100ms;

/// Sends frames at 10 Hz and records the detections.
class Takeover : public ::testing::Test {
 protected:
  Takeover() {
    model_ = testing::TinyModel{}.write(folder_.file("model"));
    loop_.on(detections_, [this](const Detections& d) {
      arrivals_.emplace_back(d.instance, d.stamp.sequence);
      if (once_.first(d.stamp.source, d.stamp.sequence)) used_[d.stamp.sequence] = d.instance;
    });
    loop_.on(models_, [this](const ModelInfo& m) { known_models_[m.instance] = m; });
  }
  std::unique_ptr<Child> start(const std::string& name, bool standby) {
    return std::make_unique<Child>(
        std::vector<std::string>{(test::programs() / "perdure-inference").string(), "--set",
                                 "model.path=" + model_, "--set",
                                 std::string("ownership.standby=") + (standby ? "true" : "false"),
                                 "--set", "ownership.period_s=0.1"},
        folder_.file(name + ".log"));
  }
  bool bothAreThere() {
    return runUntil(loop_, [&] {
      return frames_.matched() == 2 && detections_.matched() == 2 && known_models_.size() == 2;
    });
  }
  /// Sends one frame and waits for one period.
  void sendFrame() {
    static const auto pixels =
        std::make_shared<const std::vector<std::uint8_t>>(64 * 64, std::uint8_t{100});
    Frame frame;
    frame.stamp.source = 77;
    frame.stamp.sequence = next_++;
    frame.stamp.time = fromNanoseconds(static_cast<std::int64_t>(next_) * 100'000'000);
    frame.camera = "cam0";
    frame.width = 64;
    frame.height = 64;
    frame.data = pixels;
    ASSERT_TRUE(frames_.write(frame));
    const auto end = std::chrono::steady_clock::now() + kPeriod;
    while (std::chrono::steady_clock::now() < end) loop_.runOnce(5ms);
  }
  void sendFrames(int n) {
    for (int i = 0; i < n; ++i) sendFrame();
  }
  /// Sends at most `limit` frames until detections of `instance` are used; returns their number.
  int framesUntilHeard(InstanceId instance, int limit) {
    for (int n = 0; n < limit; ++n) {
      if (!used_.empty() && used_.rbegin()->second == instance) return n;
      sendFrame();
    }
    return limit;
  }
  int unusedFrom(std::uint64_t first) const {
    int unused = 0;
    for (std::uint64_t i = first; i < next_; ++i) unused += !used_.contains(i);
    return unused;
  }
  /// Returns the instance whose detections are used while both processes run.
  InstanceId owner() const { return used_.rbegin()->second; }

  test::Folder folder_;
  bus::Domain domain_{test::ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Writer<Frame> frames_{participant_, bus::frameTopic("cam0")};
  bus::Reader<Detections> detections_{participant_, bus::kTopic<Detections>};
  bus::Reader<ModelInfo> models_{participant_, bus::kTopic<ModelInfo>};
  bus::WaitLoop loop_{participant_};
  std::string model_;
  std::uint64_t next_ = 0;
  std::vector<std::pair<InstanceId, std::uint64_t>> arrivals_;
  std::map<std::uint64_t, InstanceId> used_;
  std::map<InstanceId, ModelInfo> known_models_;
  bus::Once once_;
};

TEST_F(Takeover, StandbyTakesOverWithinFourFramesOfTheOwnersDeath) {
  auto first = start("owner", false);
  ASSERT_TRUE(runUntil(loop_, [&] { return known_models_.size() == 1; })) << first->log();
  const InstanceId owner_id = known_models_.begin()->first;
  auto second = start("standby", true);
  ASSERT_TRUE(bothAreThere()) << second->log();
  ASSERT_LT(framesUntilHeard(owner_id, 30), 30) << first->log();
  sendFrames(10);
  EXPECT_EQ(owner(), owner_id) << "the standby is not heard while the owner lives";

  const std::uint64_t killed_at = next_;
  first->signal(SIGKILL);
  sendFrames(15);
  EXPECT_NE(owner(), owner_id);
  EXPECT_EQ(unusedFrom(killed_at), 0) << "the spare says again what nobody answered";
  EXPECT_EQ(used_.size() + static_cast<std::size_t>(unusedFrom(0)), next_);
  EXPECT_LE(once_.repeated(), 10u) << "what comes twice is dropped by readers, and is rare";
  EXPECT_EQ(known_models_[owner()].classes, (std::vector<std::string>{"car", "person"}));
  second->signal(SIGTERM);
  EXPECT_EQ(second->wait(5s), 0) << second->log();
}

TEST_F(Takeover, AStoppedOwnerThatWakesSendsNothingOld) {
  auto first = start("owner", false);
  ASSERT_TRUE(runUntil(loop_, [&] { return known_models_.size() == 1; })) << first->log();
  const InstanceId owner_id = known_models_.begin()->first;
  auto second = start("standby", true);
  ASSERT_TRUE(bothAreThere()) << second->log();
  ASSERT_LT(framesUntilHeard(owner_id, 30), 30);
  sendFrames(5);
  first->signal(SIGSTOP);
  const std::uint64_t stopped_at = next_;
  sendFrames(15);
  ASSERT_NE(owner(), owner_id);
  EXPECT_LE(unusedFrom(stopped_at), 4);

  const std::size_t woken_at = arrivals_.size();
  const std::uint64_t newest = arrivals_.back().second;
  first->signal(SIGCONT);
  sendFrames(40);
  EXPECT_NE(owner(), owner_id) << "it takes nothing back unasked";
  for (std::size_t i = woken_at; i < arrivals_.size(); ++i) {
    EXPECT_GE(arrivals_[i].second, newest) << "an old result came through";
  }
  second->signal(SIGKILL);
  EXPECT_LT(framesUntilHeard(owner_id, 10), 10) << "in form again it is a warm spare";
}

TEST_F(Takeover, AnOrderedEndLosesNoFrame) {
  auto first = start("owner", false);
  ASSERT_TRUE(runUntil(loop_, [&] { return known_models_.size() == 1; })) << first->log();
  const InstanceId owner_id = known_models_.begin()->first;
  auto second = start("standby", true);
  ASSERT_TRUE(bothAreThere()) << second->log();
  ASSERT_LT(framesUntilHeard(owner_id, 30), 30);
  sendFrames(5);
  const std::uint64_t told_at = next_;
  first->signal(SIGTERM);
  sendFrames(10);
  EXPECT_EQ(first->wait(5s), 0) << first->log();
  EXPECT_NE(owner(), owner_id);
  EXPECT_LE(unusedFrom(told_at), 1);
}

TEST(InferenceProgram, SaysTheFixAndTheStatusWhereItCannotStart) {
  test::ownNetwork();
  test::Folder folder;
  const std::string program = (test::programs() / "perdure-inference").string();
  std::ofstream(folder.file("not.onnx")) << "\x08\x07this is no network";
  std::ofstream(folder.file("not.onnx.model.json")) << testing::TinyModel{}.json();
  Child garbage({program, "--set", "model.path=" + folder.file("not.onnx")},
                folder.file("garbage"));
  EXPECT_EQ(garbage.wait(10s), 78);
  EXPECT_THAT(garbage.log(), ::testing::HasSubstr("not a network that can be loaded"));
  Child missing({program, "--set", "model.path=/nowhere.onnx"}, folder.file("missing"));
  EXPECT_EQ(missing.wait(10s), 69);
  EXPECT_THAT(missing.log(), ::testing::HasSubstr("/nowhere.onnx is missing"));
}

}  // namespace
}  // namespace perdure::inference

// Tests LiveCamera with simulated cameras.
#include "services/capture/live/live_camera.h"

#include <gmock/gmock.h>

#include <future>

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

CameraShot shot(std::uint32_t sequence, std::int64_t time_ns = 0) {
  return {sequence, time_ns, Frame{}};
}

/// The answers of a session, call by call: a shot, or nothing. After the last one, the camera is
/// unplugged or silent. With `gone_after`, it reports the unplug after that many answers, but still
/// has the rest.
struct Script {
  std::vector<std::optional<CameraShot>> answers;
  bool unplugged = false;
  std::optional<std::size_t> gone_after = {};
  std::string note = {};
};

class ScriptedSession : public CameraSession {
 public:
  explicit ScriptedSession(Script script) : script_(std::move(script)) {}

  std::string name() const override { return "scripted"; }
  std::string note() const override { return script_.note; }
  bool gone() const override {
    return script_.unplugged && next_ >= script_.gone_after.value_or(script_.answers.size());
  }
  std::optional<CameraShot> next(std::chrono::milliseconds longest) override {
    if (next_ < script_.answers.size()) return std::move(script_.answers[next_++]);
    std::this_thread::sleep_for(longest / 10);
    return std::nullopt;
  }

 private:
  Script script_;
  std::size_t next_ = 0;
};

class Camera : public ::testing::Test {
 protected:
  /// Plays the sessions in sequence; then no camera is left.
  void play(std::vector<Script> scripts, double rate_hz = 20.0) {
    scripts_ = std::move(scripts);
    camera_ = std::make_unique<LiveCamera>(
        [this] { return open(); }, rate_hz,
        [this](CameraImage image) { numbers_.push_back(image.number); });
    ASSERT_EQ(played_.get_future().wait_for(20s), std::future_status::ready);
  }
  std::uint64_t counted(const std::string& reason) { return camera_->state().reasons().of(reason); }

  std::vector<std::uint64_t> numbers_;  ///< written before played_, read after it

 private:
  Result<std::unique_ptr<CameraSession>> open() {
    if (opened_ < scripts_.size()) {
      return std::make_unique<ScriptedSession>(std::move(scripts_[opened_++]));
    }
    if (std::exchange(done_, true)) return fail("camera_absent");
    played_.set_value();
    return fail("camera_absent", "no camera is left");
  }

  std::vector<Script> scripts_;
  std::size_t opened_ = 0;
  bool done_ = false;
  std::promise<void> played_;

 protected:
  std::unique_ptr<LiveCamera> camera_;  // its thread uses all members above
};

TEST_F(Camera, NumbersGoOnWhenItWasUnplugged) {
  play({{.answers = {shot(0), shot(1), shot(2)}, .unplugged = true},
        {.answers = {shot(0), shot(1)}, .unplugged = true}});
  EXPECT_THAT(numbers_, ElementsAre(0, 1, 2, 3, 4));
}

TEST_F(Camera, CountsALossOnce) {
  play({{.answers = {shot(0)}, .unplugged = true}});
  EXPECT_EQ(counted("camera_lost"), 1U);
  EXPECT_EQ(counted("camera_silent"), 0U);
}

TEST_F(Camera, GivesWhatTheCameraHadGivenWhenItWasUnplugged) {
  play({{.answers = {shot(0), shot(1), shot(2)}, .unplugged = true, .gone_after = 1}});
  EXPECT_THAT(numbers_, ElementsAre(0, 1, 2));
  EXPECT_EQ(counted("camera_lost"), 1U);
}

TEST_F(Camera, CountsFramesThatTheDriverLost) {
  play({{.answers = {shot(0), shot(4), shot(5)}, .unplugged = true}});
  EXPECT_THAT(numbers_, ElementsAre(0, 4, 5));
  EXPECT_EQ(counted("camera_frame_lost"), 3U);
}

TEST_F(Camera, CountsABrokenFrameAsBrokenAndNotAsLost) {
  play({{.answers = {shot(0), CameraShot{1, 0, fail("camera_frame_error")}, shot(2)},
         .unplugged = true}});
  EXPECT_THAT(numbers_, ElementsAre(0, 2));
  EXPECT_EQ(counted("camera_frame_error"), 1U);
  EXPECT_EQ(counted("camera_frame_lost"), 0U);
}

TEST_F(Camera, IsOpenedAgainWhereItIsSilent) {
  play({{.answers = {shot(0)}}, {.answers = {shot(0)}, .unplugged = true}});
  EXPECT_THAT(numbers_, ElementsAre(0, 1));
  EXPECT_EQ(counted("camera_silent"), 1U);
  EXPECT_EQ(counted("camera_lost"), 1U);
}

/// A stopped process wakes from a single wait, even if the clock has advanced far.
TEST_F(Camera, IsNotSilentForAProcessThatWasStopped) {
  play({{.answers = {shot(0), std::nullopt, shot(40), std::nullopt, std::nullopt, shot(41)},
         .unplugged = true}});
  EXPECT_THAT(numbers_, ElementsAre(0, 40, 41));
  EXPECT_EQ(counted("camera_silent"), 0U);
}

/// Produces images until the test ends.
class EndlessSession : public CameraSession {
 public:
  explicit EndlessSession(double hz) : hz_(hz) {}
  std::string name() const override { return "endless"; }
  std::string note() const override { return "It has no gain."; }
  bool gone() const override { return false; }
  std::optional<CameraShot> next(std::chrono::milliseconds) override {
    std::this_thread::sleep_for(1ms);
    const std::uint32_t sequence = sequence_++;
    return shot(sequence, static_cast<std::int64_t>(1e9 / hz_ * sequence));
  }

 private:
  const double hz_;
  std::uint32_t sequence_ = 0;
};

TEST(LiveCamera, IsWellWhereTheCameraKeepsItsOwnRateAndSaysSo) {
  const LiveCamera camera([] { return std::make_unique<EndlessSession>(30.0); }, 20.0,
                          [](CameraImage) {});
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (camera.state().note().find("30 images") == std::string::npos) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << camera.state().note();
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_EQ(camera.state().problem(), "");
  EXPECT_THAT(camera.state().note(), HasSubstr("It has no gain. The camera gives 30 images"));
}

}  // namespace
}  // namespace perdure::capture

#include "services/capture/loader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>

#include "common/base/errors.h"
#include "common/vision/jpeg.h"
#include "services/capture/run_file.h"
#include "tests/services/capture/tiny_drive.h"

namespace perdure::capture {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class LoaderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("perdure_capture_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  struct Loaded {
    std::vector<std::pair<std::uint64_t, std::string>> frames;
    std::vector<std::int64_t> samples_ns, frames_ns;
    ReasonCounts reasons;
    std::string problem;
    std::size_t compressed = 0;
  };
  /// Loads the drive until its end, or until there are `most` frames.
  Loaded load(const testing::TinyDrive& drive, std::uint64_t first = 0, std::size_t most = 1000) {
    config_.dataset.path = drive.write(folder_);
    Loaded out;
    std::mutex mutex;
    std::condition_variable changed;
    std::uint64_t notes = 0;
    Loader loader(config_, openDrive(config_, 9), first, [&] {
      const std::lock_guard lock(mutex);
      ++notes;
      changed.notify_one();
    });
    for (std::uint64_t seen = 0; out.frames.size() < most; ++seen) {
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return notes > seen; });
      }
      const bool ended = loader.ended();
      auto message = loader.take();
      if (!message && ended) break;
      if (!message) continue;
      if (auto* frame = std::get_if<Frame>(&*message)) {
        EXPECT_EQ(frame->stamp.source, 9u);
        out.compressed += isCompressed(frame->encoding);
        const auto pixels = vision::decompressed(*frame);
        EXPECT_TRUE(pixels);
        const double rounding = isCompressed(frame->encoding) ? 1.0 : 0.0;
        EXPECT_NEAR(pixels->data->front(),
                    frame->stamp.sequence % static_cast<std::uint64_t>(drive.frames), rounding)
            << "the pixels are of another frame";
        out.frames_ns.push_back(toNanoseconds(frame->stamp.time));
        out.frames.emplace_back(frame->stamp.sequence, frame->camera);
      } else if (auto* imu = std::get_if<ImuSample>(&*message)) {
        out.samples_ns.push_back(toNanoseconds(imu->time));
      }
    }
    out.reasons = loader.reasons();
    out.problem = loader.lastProblem();
    return out;
  }
  std::pair<ExitCode, std::string> error() {
    try {
      openDrive(config_, 1);
    } catch (const StartupError& e) {
      return {e.code(), e.what()};
    }
    return {ExitCode::kOk, ""};
  }

  fs::path folder_;
  Config config_;
};

TEST_F(LoaderTest, GivesAllFramesAndTheSamplesAroundThem) {
  testing::TinyDrive drive;
  drive.imu_before_ns = 10'000'000'000;
  drive.imu_after_ns = 10'000'000'000;
  config_.dataset.lead_s = 0.5;
  config_.dataset.trail_s = 0.2;
  const Loaded out = load(drive);
  EXPECT_EQ(out.frames.size(), 20u);
  EXPECT_EQ(out.samples_ns.front(), drive.start_ns - 500'000'000);
  EXPECT_EQ(out.samples_ns.back(), drive.start_ns + 19 * drive.frame_period_ns + 200'000'000);
}

TEST_F(LoaderTest, ADriveThatRepeatsGoesOnInTimeAndNumberWithoutASeam) {
  testing::TinyDrive drive;
  drive.imu_before_ns = 300'000'000;  // samples before the first and after the last frame must not
                                      // be repeated
  drive.imu_after_ns = 300'000'000;
  config_.run.on_end = "repeat";
  const Loaded out = load(drive, 0, 50);
  ASSERT_EQ(out.frames.size(), 50u);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(out.frames[i].first, i);
    EXPECT_EQ(out.frames_ns[i],
              drive.start_ns + static_cast<std::int64_t>(i) * drive.frame_period_ns);
  }
  EXPECT_EQ(out.samples_ns.front(), drive.start_ns - drive.imu_before_ns);
  for (std::size_t i = 1; i < out.samples_ns.size(); ++i) {
    ASSERT_EQ(out.samples_ns[i] - out.samples_ns[i - 1], drive.imu_period_ns) << i;
  }
  EXPECT_TRUE(out.reasons.all().empty());
}

TEST_F(LoaderTest, ARepeatedDriveCarriesOnInTheLapWhereItWas) {
  testing::TinyDrive drive;
  drive.imu_after_ns = 300'000'000;
  config_.run.on_end = "repeat";
  const Loaded out = load(drive, 60, 5);  // the first frame of the fourth lap
  ASSERT_EQ(out.frames.size(), 5u);
  EXPECT_EQ(out.frames[0].first, 59u) << "with the samples between it and the next";
  EXPECT_EQ(out.frames_ns[1], drive.start_ns + 60 * drive.frame_period_ns);
  EXPECT_LE(out.samples_ns.front(), out.frames_ns[0]);
}

TEST_F(LoaderTest, MonoLeavesTheSecondCameraOut) {
  testing::TinyDrive drive;
  drive.stereo = true;
  EXPECT_EQ(load(drive).frames.size(), 40u);
  config_.dataset.cameras = "mono";
  EXPECT_EQ(load(drive).frames.size(), 20u);
}

TEST_F(LoaderTest, CompressesImagesWhereItIsTold) {
  EXPECT_EQ(load({}).compressed, 0u);
  config_.image.compress = "jpeg";
  const Loaded out = load({});
  EXPECT_EQ(out.frames.size(), 20u);
  EXPECT_EQ(out.compressed, 20u);
}

TEST_F(LoaderTest, StartsAtTheFrameItIsToldTo) {
  const Loaded out = load({}, 15);
  ASSERT_EQ(out.frames.size(), 5u);
  EXPECT_EQ(out.frames[0].first, 15u);
}

TEST_F(LoaderTest, CountsATruncatedImageAndAGapOfTheImuAndGoesOn) {
  testing::TinyDrive drive;
  drive.truncated = 7;
  drive.imu_gap_after = 3;
  const Loaded out = load(drive);
  EXPECT_EQ(out.frames.size(), 19u);
  EXPECT_EQ(out.reasons.of("image_truncated") + out.reasons.of("image_corrupt"), 1u);
  EXPECT_EQ(out.reasons.of("imu_gap"), 1u);
  EXPECT_FALSE(out.problem.empty());
}

TEST_F(LoaderTest, StopsAtOnceWhileItIsFull) {
  config_.dataset.path = testing::TinyDrive{}.write(folder_);
  const Loader loader(config_, openDrive(config_, 9), 0, [] {});
  SUCCEED() << "the destructor must not wait for a taker";
}

TEST_F(LoaderTest, SaysWhatIsMissing) {
  EXPECT_EQ(error().first, ExitCode::kConfiguration);
  EXPECT_THAT(error().second, HasSubstr("dataset.path"));
  config_.dataset.path = (folder_ / "nowhere").string();
  EXPECT_EQ(error().first, ExitCode::kUnavailable);
  EXPECT_THAT(error().second, HasSubstr("nowhere"));
  config_.dataset.path = testing::TinyDrive{}.write(folder_);
  fs::remove(folder_ / "mav0/cam0/sensor.yaml");
  EXPECT_EQ(error().first, ExitCode::kUnavailable);
  EXPECT_THAT(error().second, HasSubstr("sensor.yaml"));
  config_.source = "libcamera";
  EXPECT_EQ(error().first, ExitCode::kConfiguration);
  EXPECT_THAT(error().second, HasSubstr("source: libcamera needs rig"));
}

TEST_F(LoaderTest, RefusesADriveWithoutReadableImages) {
  testing::TinyDrive drive;
  drive.frames = 1;
  drive.truncated = 0;
  config_.dataset.path = drive.write(folder_);
  EXPECT_EQ(error().first, ExitCode::kData);
  EXPECT_THAT(error().second, HasSubstr("no image of cam0 that was tried (1) can be read"));
}

TEST_F(LoaderTest, RunFileIsReadBackOnlyForTheSameRun) {
  config_.dataset.path = testing::TinyDrive{}.write(folder_);
  EXPECT_FALSE(readRunState(config_)) << "no file is configured";
  config_.run.state = (folder_ / "run").string();
  EXPECT_FALSE(readRunState(config_)) << "there is no file yet";
  RunState state;
  state.drive = driveOf(config_);
  state.boot = bootId();
  state.next_sequence = 5;
  ASSERT_TRUE(writeRunState(config_.run.state, state));
  ASSERT_TRUE(readRunState(config_));
  EXPECT_EQ(readRunState(config_)->next_sequence, 5u);
  config_.pace.rate = 2;
  EXPECT_FALSE(readRunState(config_)) << "another rate is another run";
  EXPECT_FALSE(writeRunState((folder_ / "no/such/folder").string(), state));
}

}  // namespace
}  // namespace perdure::capture

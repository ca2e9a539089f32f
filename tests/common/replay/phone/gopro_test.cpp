#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/dataset.h"
#include "common/replay/phone/gpmf.h"
#include "tests/common/replay/phone/tiny_gopro.h"
#include "tests/common/replay/phone/tiny_phones.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kSamples =
    400;  // of the gyroscope, without the last 5 ms of the accelerometer
constexpr double kFirstFrame_s = 10.0;

fs::path goPro(const std::string& name, const TinyGoPro& how = {}) {
  const fs::path film = freshFolder(name) / "GX010001.MP4";
  writeGoPro(film, how);
  return film;
}

std::unique_ptr<Dataset> openGoPro(const fs::path& path) {
  return Dataset::open({.path = path, .uncalibrated = true});
}
std::string errorOfGoPro(const fs::path& path) {
  return startupErrorOf([&] { openGoPro(path); });
}

/// Checks values and stamps of all samples; each is named by its value about x.
void expectSamples(const Dataset& dataset, double within_s) {
  ASSERT_FALSE(dataset.recording().imu.empty());
  for (const ImuSample& sample : dataset.recording().imu) {
    const double number = 1e3 * sample.gyro.x();
    EXPECT_NEAR(toSeconds(sample.time), kFirstFrame_s + 5e-3 * number, within_s);
    EXPECT_NEAR(sample.gyro.y(), 0.2, 1e-12);
    EXPECT_NEAR(sample.gyro.z(), -0.3, 1e-12);
    EXPECT_NEAR(sample.accel.x(), 0.5e-3 * number, 1e-3);
    EXPECT_NEAR(sample.accel.y(), 9.807, 1e-12);
  }
}

TEST(GoPro, SamplesHaveTheStampsOfTheCamerasClock) {
  const fs::path film = goPro("gopro", {.jitter_ms = {0, 6, -4, 1}});
  for (const fs::path& path : {film, film.parent_path()}) {
    const auto dataset = openGoPro(path);
    EXPECT_EQ(dataset->kind(), DatasetKind::kPhone);
    EXPECT_EQ(dataset->frameCount(), std::size_t{kFilmFrames});
    EXPECT_NEAR(toSeconds(*dataset->frameTime(20)), kFirstFrame_s + 1.0, 1e-6);
    EXPECT_NEAR(static_cast<double>(dataset->recording().imu.size()), kSamples, 2.0);
    expectSamples(*dataset, 2e-3);  // the median jitter of the packets
    EXPECT_NEAR(dataset->calibration().imu->rate_hz, 200.0, 0.01);
    EXPECT_EQ(dataset->calibration().cameras[0].width, 64U);
    EXPECT_EQ(numberOf(dataset->frameAt(13).value()), 13);
  }
}

TEST(GoPro, BothSensorsShareTheCamerasClock) {
  const auto same = openGoPro(goPro("gopro_same"));
  const auto late = openGoPro(goPro("gopro_late", {.accel_late_us = 20'000}));
  const ImuSample& before = same->recording().imu[200];
  for (const ImuSample& sample : late->recording().imu) {
    if (std::abs(sample.gyro.x() - before.gyro.x()) > 1e-9) continue;
    EXPECT_NEAR(sample.accel.x(), before.accel.x() - 2e-3, 1e-6);  // 2 samples of 1 mm/s² less
  }
}

TEST(GoPro, WithoutStampsThePacketsLieOnALine) {
  const auto dataset =
      openGoPro(goPro("gopro_line", {.stamps = false, .jitter_ms = {0, 5, -5, 0}}));
  expectSamples(*dataset, 6e-3);
  const auto& imu = dataset->recording().imu;
  for (std::size_t i = 1; i < imu.size(); ++i) {
    EXPECT_NEAR(toSeconds(imu[i].time - imu[i - 1].time), 5e-3, 1e-4);
  }
}

TEST(GoPro, ALostPacketIsAGapAndADamagedOneIsCounted) {
  const auto lost = openGoPro(goPro("gopro_lost", {.lost = 2}));
  expectSamples(*lost, 1e-3);
  EXPECT_NEAR(static_cast<double>(lost->recording().imu.size()), kSamples - 100, 2.0);
  const auto damaged = openGoPro(goPro("gopro_damaged", {.damaged = 1}));
  expectSamples(*damaged, 1e-3);
  EXPECT_EQ(damaged->recording().reasons.of("telemetry_damaged"), 1U);
}

TEST(GoPro, AStabilisedFilmIsRefused) {
  const std::string error = errorOfGoPro(goPro("gopro_stabilised", {.image_turn = 2862}));
  EXPECT_THAT(error, AllOf(HasSubstr("up to 10°"), HasSubstr("stabilisation off")));
}

TEST(GoPro, AFilmWithoutTelemetryAndSeveralFilmsAreNamed) {
  const fs::path folder = freshFolder("gopro_none");
  writeFilm(folder / "holiday.mp4");
  writeText(folder / "cut.mp4", "no film");
  EXPECT_THAT(errorOfGoPro(folder / "cut.mp4"), HasSubstr("was not finished"));
  fs::remove(folder / "cut.mp4");
  EXPECT_THAT(errorOfGoPro(folder / "holiday.mp4"),
              AllOf(HasSubstr("holiday.mp4 has no track"), HasSubstr("as the camera")));
  EXPECT_THAT(errorOfGoPro(folder), HasSubstr("no dataset folder"));
  writeGoPro(folder / "GX010001.MP4");
  EXPECT_THAT(errorOfGoPro(folder), AllOf(HasSubstr("2 films"), HasSubstr("--data")));
}

TEST(Gpmf, NumbersAreReadWithTheirSigns) {
  const std::string text = gpmfNumbers("GYRO", 's', {-2, 3, 4}, 3) + gpmfNumbers("TSMP", 'L', {7}) +
                           gpmfItem("FLOA", 'f', 4, 1, std::string("\xc0\x20\0\0", 4));
  const auto items = phone::itemsOf(text);
  ASSERT_TRUE(items);
  ASSERT_EQ(items->size(), 3U);
  EXPECT_EQ(phone::numbersOf((*items)[0]), (std::vector<double>{-2, 3, 4}));
  EXPECT_EQ(phone::numbersOf((*items)[1]), std::vector<double>{7});
  EXPECT_EQ(phone::numbersOf((*items)[2]), std::vector<double>{-2.5});
  EXPECT_FALSE(phone::itemsOf(text.substr(0, 12)));
}

}  // namespace
}  // namespace perdure::replay

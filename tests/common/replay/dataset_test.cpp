#include "common/replay/dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/read_ahead.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::uint64_t> frameIndices(Dataset& dataset) {
  std::vector<std::uint64_t> indices;
  while (auto message = dataset.next()) {
    if (const auto* frame = std::get_if<Frame>(&*message)) indices.push_back(frame->stamp.sequence);
  }
  return indices;
}

TEST(Dataset, FoldersThatAreNoneAreToldWhatTheyCouldBe) {
  const auto folder = freshFolder("nothing");
  const auto error = startupErrorOf([&] { Dataset::open({.path = folder}); });
  EXPECT_THAT(error, HasSubstr("EuRoC"));
  EXPECT_THAT(error, HasSubstr("KITTI"));
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = folder / "no"}); }),
              HasSubstr("the dataset folder is missing"));
}

TEST(Dataset, EachNthFrameComesWithItsPartnerNumberAndAllSamples) {
  const auto root = tinyEuroc("each_second", true);
  const auto all = Dataset::open({.path = root}), some = Dataset::open({.path = root, .every = 2});
  EXPECT_THAT(frameIndices(*some), ElementsAre(0, 0, 2, 2, 4, 4));
  EXPECT_EQ(some->frameCount(), 3U);
  EXPECT_EQ(some->recording().imu.size(), all->recording().imu.size());
  EXPECT_DOUBLE_EQ(some->calibration().cameras[0].rate_hz,
                   all->calibration().cameras[0].rate_hz / 2);
  EXPECT_EQ(some->skip(durationFromSeconds(0.05)), 2U);
}

TEST(ReadAhead, GivesWhatTheDriveHasInItsOrderAndMayEndEarly) {
  const auto root = tinyEuroc("ahead");
  const auto plain = Dataset::open({.path = root}), read = Dataset::open({.path = root});
  {
    ReadAhead ahead(*read, 2);
    while (const auto expected = plain->next()) {
      const auto message = ahead.next();
      ASSERT_TRUE(message);
      EXPECT_EQ(message->index(), expected->index());
      const auto* frame = std::get_if<Frame>(&*message);
      if (frame) {
        EXPECT_EQ(frame->stamp.time, std::get<Frame>(*expected).stamp.time);
      }
    }
    EXPECT_FALSE(ahead.next());
    EXPECT_FALSE(ahead.next());
  }
  const auto again = Dataset::open({.path = root});
  ReadAhead unread(*again, 1);  // the object is destroyed while its thread waits for space
  EXPECT_TRUE(unread.next());
}

TEST(Dataset, ATruncatedImageIsCountedAndItsIndexNotGivenAgain) {
  const auto root = tinyEuroc("truncated");
  truncate(root / "mav0/cam0/data/1050000000.png", 0.6);
  fs::remove(root / "mav0/cam0/data/1100000000.png");
  writeText(root / "mav0/cam0/data/1150000000.png", "no image at all");
  const auto dataset = Dataset::open({.path = root});
  EXPECT_THAT(frameIndices(*dataset), ElementsAre(0, 4));
  EXPECT_EQ(dataset->reasons().of("image_truncated"), 1U);
  EXPECT_EQ(dataset->reasons().of("image_missing"), 1U);
  EXPECT_EQ(dataset->reasons().of("image_corrupt"), 1U);
  EXPECT_THAT(dataset->lastProblem(), HasSubstr("1150000000.png"));
}

TEST(Dataset, ATruncatedJpegIsCountedToo) {
  const auto drive = tinyKittiRaw("truncated_jpeg");
  truncate(drive / "image_02/data/0000000002.jpg", 0.7);
  fs::remove_all(drive / "image_03");
  const auto dataset = Dataset::open({.path = drive});
  EXPECT_THAT(frameIndices(*dataset), ElementsAre(0, 1, 3));
  EXPECT_EQ(dataset->reasons().of("image_truncated"), 1U);
}

TEST(Dataset, AnImageOfAnotherSizeThanTheCalibrationsIsCounted) {
  const auto root = tinyEuroc("size");
  writeImage(root / "mav0/cam0/data/1050000000.png", 16, 24, 1);
  const auto dataset = Dataset::open({.path = root});
  EXPECT_THAT(frameIndices(*dataset), ElementsAre(0, 2, 3, 4));
  EXPECT_EQ(dataset->reasons().of("image_size"), 1U);
}

/// The brightest image of the first camera is its last one, at an odd place among those of both.
TEST(Dataset, TheScaleOfDeepImagesIsSampledFromEachCameraOfAStereoDrive) {
  const auto root = tinyEuroc("deep_stereo", true);
  for (const char* stamp : {"1000000000", "1050000000", "1100000000", "1150000000", "1200000000"}) {
    const bool last = std::string(stamp) == "1200000000";
    writeDeepImage(root / "mav0/cam0/data" / (std::string(stamp) + ".png"), 32, 24, last ? 14 : 10);
  }
  const auto dataset = Dataset::open({.path = root});
  int brightest = 0;
  while (const auto message = dataset->next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (frame == nullptr || frame->camera != "cam0" || frame->stamp.sequence != 0) continue;
    for (const auto byte : *frame->data) brightest = std::max(brightest, static_cast<int>(byte));
  }
  EXPECT_EQ(brightest, 16) << "all images have the scale of 14 bits";
}

TEST(Dataset, SamplesThatAreDecadesApartAreNoGap) {
  const auto root = tinyEuroc("decades");
  std::string text = "#timestamp [ns],w,w,w,a,a,a\n";
  for (const char* stamp : {"0", "2000000000000000000", "4000000000000000000",
                            "6000000000000000000", "8000000000000000000"}) {
    text += std::string(stamp) + ",0,0,0,0,0,9.81\n";
  }
  writeText(root / "mav0/imu0/data.csv", text);
  const auto dataset = Dataset::open({.path = root});
  int samples = 0;
  while (const auto message = dataset->next())
    samples += std::holds_alternative<ImuSample>(*message);
  EXPECT_EQ(samples, 5);
  EXPECT_EQ(dataset->reasons().of("imu_gap"), 0U);
}

TEST(Dataset, AGapOfTheInertialSamplesIsCountedWhenItIsOver) {
  const auto root = tinyEuroc("gap");
  const auto file = root / "mav0/imu0/data.csv";
  std::string text = readText(file);
  const auto from = text.find("1050000000"), to = text.find("1150000000");
  writeText(file, text.erase(from, to - from));
  const auto dataset = Dataset::open({.path = root});
  EXPECT_EQ(dataset->reasons().of("imu_gap"), 0U);
  EXPECT_THAT(frameIndices(*dataset), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_EQ(dataset->reasons().of("imu_gap"), 1U);
}

TEST(Dataset, WithoutDecodingFramesKeepStampsAndSizes) {
  const auto dataset = Dataset::open({.path = tinyEuroc("no_decode"), .decode = false});
  std::size_t frames = 0;
  while (auto message = dataset->next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (frame == nullptr) continue;
    ++frames;
    EXPECT_FALSE(frame->data);
    EXPECT_EQ(frame->width, 32U);
  }
  EXPECT_EQ(frames, 5U);
}

TEST(Dataset, MessagesCarryTheSourceThatWasAskedFor) {
  const auto dataset = Dataset::open({.path = tinyEuroc("source"), .source = 42});
  EXPECT_EQ(dataset->calibration().source, 42U);
  while (auto message = dataset->next()) {
    if (const auto* frame = std::get_if<Frame>(&*message)) {
      EXPECT_EQ(frame->stamp.source, 42U);
    } else {
      EXPECT_EQ(std::get<ImuSample>(*message).source, 42U);
    }
  }
}

TEST(Dataset, SeekGoesOnWhereAnotherStopped) {
  const auto root = tinyEuroc("seek");
  const auto whole = Dataset::open({.path = root}), late = Dataset::open({.path = root});
  while (auto message = whole->next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (frame != nullptr && frame->stamp.sequence == 2) break;
  }
  late->seek(3);
  while (auto expected = whole->next()) {
    const auto message = late->next();
    ASSERT_TRUE(message);
    ASSERT_EQ(message->index(), expected->index());
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      EXPECT_EQ(imu->sequence, std::get<ImuSample>(*expected).sequence);
    } else {
      EXPECT_EQ(std::get<Frame>(*message).stamp.sequence,
                std::get<Frame>(*expected).stamp.sequence);
    }
  }
  EXPECT_FALSE(late->next());
}

TEST(Dataset, SkipGoesToTheFirstFrameThatIsSoLate) {
  const auto dataset = Dataset::open({.path = tinyEuroc("skip", true)});  // one frame every 50 ms
  EXPECT_EQ(dataset->skip(std::chrono::milliseconds(60)), 2U);
  const auto first = dataset->next();
  ASSERT_TRUE(first);
  const auto* imu = std::get_if<ImuSample>(&*first);
  ASSERT_NE(imu, nullptr) << "the samples since the frame before come first";
  EXPECT_GT(imu->time, *dataset->frameTime(1));
  EXPECT_THAT(frameIndices(*dataset), ElementsAre(2, 2, 3, 3, 4, 4));
  EXPECT_EQ(dataset->skip(Duration(0)), 0U);
  EXPECT_EQ(dataset->skip(std::chrono::milliseconds(200)), 4U);
  EXPECT_FALSE(dataset->skip(std::chrono::milliseconds(201)));
}

}  // namespace
}  // namespace perdure::replay

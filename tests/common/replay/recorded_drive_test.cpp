// Recordings as datasets, and as messages in their order of arrival.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/replay/dataset.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint64_t kLater = 1'000'000'000'000;  // offset of the log times from the sensor
                                                     // times

std::uint64_t logOf(TimePoint time) {
  return kLater + static_cast<std::uint64_t>(toNanoseconds(time));
}

/// Records all messages of a dataset as capture would publish them.
void record(Dataset& dataset, RecordingWriter& recording, bool images) {
  recording.add("calibration", dataset.calibration(), kLater);
  int n = 0;
  while (const auto message = dataset.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      recording.add("imu", *imu, logOf(imu->time));
    } else if (const auto* frame = std::get_if<Frame>(&*message)) {
      if (images) recording.add("frame/" + frame->camera, *frame, logOf(frame->stamp.time));
      Odometry odometry;
      odometry.stamp = frame->stamp;
      if (!images && frame->camera == "cam0") {
        recording.add("odometry", odometry, logOf(frame->stamp.time) + 1000);
      }
    }
    if (++n % 7 == 0) recording.cut();
  }
}

struct Read {
  std::vector<std::string> order;  ///< kind, time and index of each message
  std::vector<std::vector<std::uint8_t>> pixels;
};

Read readAll(Dataset& dataset) {
  Read read;
  while (const auto message = dataset.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      read.order.push_back("imu " + std::to_string(toNanoseconds(imu->time)) + " " +
                           std::to_string(imu->gyro.x()));
    } else if (const auto* frame = std::get_if<Frame>(&*message)) {
      read.order.push_back(frame->camera + " " + std::to_string(toNanoseconds(frame->stamp.time)) +
                           " " + std::to_string(frame->stamp.sequence));
      if (frame->data) read.pixels.emplace_back((*frame->data).begin(), (*frame->data).end());
    }
  }
  return read;
}

TEST(RecordedDrive, GivesWhatTheDatasetGaveThatWasRecorded) {
  const auto source = tinyEuroc("recorded_source", true);
  const fs::path file = freshFolder("recorded") / "run.mcap";
  RecordingWriter recording(file);
  record(*Dataset::open({.path = source}), recording, true);
  recording.finish();
  const auto original = Dataset::open({.path = source});
  const auto again = Dataset::open({.path = file});
  EXPECT_EQ(again->kind(), DatasetKind::kRecording);
  EXPECT_EQ(again->frameCount(), 5u);
  EXPECT_EQ(again->calibration().cameras.size(), 2u);
  const Read a = readAll(*original), b = readAll(*again);
  EXPECT_EQ(a.order, b.order);
  ASSERT_EQ(a.pixels.size(), 10u);
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_TRUE(again->reasons().all().empty());
}

TEST(RecordedDrive, GivesAnyImageOutOfTurn) {
  const fs::path file = freshFolder("recorded_turns") / "run.mcap";
  RecordingWriter recording(file);
  record(*Dataset::open({.path = tinyEuroc("recorded_turns_source")}), recording, true);
  recording.finish();
  const auto dataset = Dataset::open({.path = file, .encoding = ImageEncoding::kBgr8});
  for (const std::uint64_t index : {3u, 0u, 4u, 1u}) {
    const auto frame = dataset->frameAt(index);
    ASSERT_TRUE(frame) << index;
    EXPECT_EQ(frame->stamp.sequence, index);
    EXPECT_EQ(frame->data->size(), 3u * frame->width * frame->height);
  }
  EXPECT_FALSE(dataset->frameAt(5));
}

TEST(RecordedDrive, WithoutImagesHasTheFramesOfItsOdometry) {
  const fs::path file = freshFolder("recorded_blind") / "run.mcap";
  RecordingWriter recording(file);
  record(*Dataset::open({.path = tinyEuroc("recorded_blind_source")}), recording, false);
  recording.finish();
  const auto dataset = Dataset::open({.path = file});
  EXPECT_EQ(dataset->frameCount(), 5u);
  EXPECT_TRUE(readAll(*dataset).pixels.empty());
}

TEST(RecordedDrive, WithoutCalibrationSaysWhatIsMissing) {
  const fs::path file = freshFolder("recorded_bare") / "run.mcap";
  RecordingWriter recording(file);
  recording.add("imu", ImuSample{}, 5);
  recording.finish();
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = file}); }),
              HasSubstr("record while capture runs"));
}

TEST(RecordedDrive, MessagesInAnEncodingThatIsNotReadAreNamed) {
  const fs::path file = freshFolder("recorded_protobuf") / "run.mcap";
  auto writer = mcap::Writer::create(file);
  mcap::Catalogue catalogue;
  catalogue.schemas[1] = {1, "foxglove.RawImage", "protobuf", "..."};
  catalogue.channels[1] = {1, 1, "/cam0", "protobuf"};
  mcap::Draft draft;
  const std::vector<std::uint8_t> data(10);
  draft.add({1, 1, 1000, 1000, data});
  ASSERT_TRUE(writer->append(mcap::pack(draft), catalogue));
  ASSERT_TRUE(writer->finish());
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = file}); }),
              AllOf(HasSubstr("on /cam0 are foxglove.RawImage in `protobuf`"),
                    HasSubstr("perdure record")));
}

TEST(RecordedDrive, AFileWithoutMessagesIsRefused) {
  const fs::path folder = freshFolder("recorded_empty");
  writeText(folder / "none.mcap", "no recording");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = folder / "none.mcap"}); }),
              HasSubstr("is no MCAP file"));
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = folder / "absent.mcap"}); }),
              HasSubstr("is missing"));
}

TEST(RecordedDrive, TakesAnyBytesAndGivesMessagesOrARefusal) {
  const fs::path folder = freshFolder("recorded_fuzz");
  {
    RecordingWriter recording(folder / "whole.mcap");
    record(*Dataset::open({.path = tinyEuroc("recorded_fuzz_source")}), recording, true);
    recording.finish();
  }
  const std::string whole = readText(folder / "whole.mcap");
  std::mt19937_64 random(9);
  int read = 0, refused = 0;
  for (int i = 0; i < 150; ++i) {
    std::string bytes = whole;
    for (std::uint64_t n = 1 + random() % 8; n > 0; --n) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    if (random() % 3 == 0) bytes.resize(random() % bytes.size());
    writeText(folder / "hurt.mcap", bytes);
    const std::string refusal = startupErrorOf([&] {
      const auto dataset = Dataset::open({.path = folder / "hurt.mcap"});
      read += readAll(*dataset).order.empty() ? 0 : 1;
    });
    refused += refusal.empty() ? 0 : 1;
  }
  EXPECT_GT(read, 40);
  EXPECT_GT(refused, 10);
}

TEST(RecordedMessages, JoinsTheSegmentsOfAFolderAndGivesLatchedOnesOnce) {
  const fs::path folder = freshFolder("segments");
  Calibration calibration;
  calibration.source = 3;
  for (int segment = 0; segment < 3; ++segment) {
    RecordingWriter recording(folder / ("perdure-00000" + std::to_string(segment) + ".mcap"));
    const auto at = static_cast<std::uint64_t>(1000 * segment);
    recording.add("calibration", calibration, at);
    for (std::uint64_t i = 0; i < 4; ++i) {
      ImuSample sample;
      sample.sequence = 4 * static_cast<std::uint64_t>(segment) + i;
      recording.add("imu", sample, at + i);
    }
    if (segment == 2) recording.cut();  // a killed recorder leaves such a file
    if (segment < 2) recording.finish();
  }
  RecordedMessages messages(folder);
  EXPECT_EQ(messages.reasons().of("unfinished"), 1u);
  EXPECT_EQ(messages.topics().at("imu").messages, 12u);
  EXPECT_EQ(messages.topics().at("imu").type, "perdure::msg::ImuSample");
  EXPECT_EQ(messages.startNs(), 0u);
  EXPECT_EQ(messages.endNs(), 2003u);
  std::vector<std::uint64_t> sequences;
  int calibrations = 0;
  while (const auto message = messages.next()) {
    if (message->topic == "calibration") ++calibrations;
    if (message->topic == "imu") sequences.push_back(valueOf<ImuSample>(*message)->sequence);
  }
  EXPECT_THAT(sequences, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_EQ(calibrations, 1);
  messages.rewind([](const std::string& topic) { return topic == "calibration"; });
  EXPECT_EQ(messages.next()->topic, "calibration");
  EXPECT_FALSE(messages.next());
}

TEST(RecordedMessages, RefusesAValueOfAnotherType) {
  const fs::path file = freshFolder("types") / "run.mcap";
  RecordingWriter recording(file);
  recording.add("imu", SpeedSample{}, 1);
  recording.finish();
  RecordedMessages messages(file);
  const auto value = valueOf<ImuSample>(*messages.next());
  ASSERT_FALSE(value);
  EXPECT_EQ(value.error().code, "other_type");
}

}  // namespace
}  // namespace perdure::replay

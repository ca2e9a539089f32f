// Runs `perdure record info`, `repair` and `export` on damaged, truncated and foreign files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "common/replay/recordings/recording_writer.h"
#include "tests/common/replay/ros_twin.h"
#include "tests/process/support.h"
#include "tests/tools/record/recorded_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

TEST(RepairProcess, AFileWithoutAWholeChunkStaysAsItIs) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  replay::RecordingWriter recording(file);
  for (std::uint64_t i = 0; i < 50; ++i) recording.add("imu", ImuSample{}, 1000 * i);
  recording.finish();
  const auto whole = replay::mcap::Reader::open(file);
  ASSERT_TRUE(whole && whole->chunks().size() == 1);
  const auto half = whole->chunks().front().offset + whole->chunks().front().length / 2;
  fs::resize_file(file, half);
  test::Child repair({perdure(), "record", "repair", file}, place.file("repair.log"));
  EXPECT_EQ(repair.wait(20s), 69);
  EXPECT_THAT(repair.log(), HasSubstr("holds no whole chunk"));
  EXPECT_EQ(fs::file_size(file), half);
}

/// Writes four chunks of ten samples each; returns their offsets.
std::vector<std::uint64_t> recordChunks(const fs::path& file) {
  replay::RecordingWriter recording(file);
  for (std::uint64_t i = 0; i < 40; ++i) {
    recording.add("imu", ImuSample{}, 1000 * i);
    if (i % 10 == 9) recording.cut();
  }
  recording.finish();
  std::vector<std::uint64_t> offsets;
  const auto reader = replay::mcap::Reader::open(file);
  for (const auto& chunk : reader->chunks()) offsets.push_back(chunk.offset);
  return offsets;
}

void setByte(const fs::path& file, std::uint64_t at, char byte) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(at));
  stream.put(byte);
}

struct Said {
  int status = 0;
  std::string text;
};

Said record(const std::string& what, const fs::path& file, const char* flag = nullptr) {
  const test::Folder logs;
  std::vector<std::string> words{perdure(), "record", what, file};
  if (flag != nullptr) words.emplace_back(flag);
  test::Child child(words, logs.file("log"));
  const int status = child.wait(20s);
  return {status, child.log()};
}

TEST(RepairProcess, DamagedChunksAreCountedAndTheFileIsNotCalledWhole) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  const auto offsets = recordChunks(file);
  ASSERT_EQ(offsets.size(), 4u);
  constexpr std::uint64_t kCrcAt = 9 + 24, kLengthAt = 8;
  setByte(file, offsets[1] + kCrcAt, 'x');
  setByte(file, offsets[2] + kLengthAt, 'x');  // 2^62 bytes
  const std::string before = test::contentsOf(file);
  const Said info = record("info", file, "--check"), repair = record("repair", file);
  EXPECT_EQ(info.status, 0);
  const std::string why = "2 of 4 chunks cannot be read; the first, at byte " +
                          std::to_string(offsets[1]) + ": a chunk with a wrong checksum";
  EXPECT_THAT(info.text, HasSubstr(why));
  EXPECT_THAT(info.text, testing::ContainsRegex("imu +20 "));
  EXPECT_EQ(repair.status, 65);
  EXPECT_THAT(repair.text, HasSubstr(why));
  EXPECT_THAT(repair.text, HasSubstr("20 messages of it are read"));
  EXPECT_EQ(test::contentsOf(file), before);
}

TEST(RepairProcess, AFileThatIsCutStaysBesideItAsItWas) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap"), copy = place.file("run.mcap.before-repair");
  fs::resize_file(file, (recordChunks(file), fs::file_size(file) / 2));
  const std::string before = test::contentsOf(file);
  const Said first = record("repair", file);
  EXPECT_EQ(first.status, 0);
  EXPECT_THAT(first.text, HasSubstr("the file as it was is " + copy.string()));
  EXPECT_EQ(test::contentsOf(copy), before);
  EXPECT_EQ(stateOf(file), "finished");
  fs::copy_file(copy, file, fs::copy_options::overwrite_existing);
  const Said second = record("repair", file);
  EXPECT_EQ(second.status, 69);
  EXPECT_THAT(second.text, HasSubstr("is there already"));
  EXPECT_EQ(test::contentsOf(file), before);
}

TEST(RepairProcess, WithoutRoomForTheCopyNothingIsTouched) {
  const test::Folder place;
  fs::create_directories(place.file("small"));
  const fs::path file = place.file("run.mcap"), there = place.file("small/run.mcap");
  recordChunks(file);
  fs::resize_file(file, fs::file_size(file) - 1);
  const std::string before = test::contentsOf(file);
  const std::string script = "mount -t tmpfs -o size=8k own " + place.file("small") + " && cp " +
                             file.string() + " " + there.string() +
                             " && dd if=/dev/zero of=" + place.file("small/ballast") +
                             " bs=1k 2> /dev/null; " + perdure() + " record repair " +
                             there.string() + "; echo status $?; ls " + place.file("small") +
                             "; cmp " + there.string() + " " + file.string() + " && echo untouched";
  test::Child child({"unshare", "-m", "sh", "-c", script}, place.file("log"));
  child.wait(20s);
  if (child.log().find("status") == std::string::npos) GTEST_SKIP() << "no right to mount a disk";
  EXPECT_THAT(child.log(), HasSubstr("status 74\nballast\nrun.mcap\nuntouched"));
}

TEST(InfoProcess, OfASqliteRecordingOfRosIsTheSameTable) {
  const test::Twin twin = test::twinOf("record_info");
  const Said said = record("info", twin.file);
  EXPECT_EQ(said.status, 0);
  EXPECT_THAT(said.text, HasSubstr("a recording of ROS"));
  EXPECT_THAT(said.text,
              testing::ContainsRegex("/cam0/image_raw +5 +[0-9.]+ Hz +sensor_msgs/Imag"));
}

TEST(ExportProcess, OfARecordingOfOthersNoFileIsMade) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap"), to = place.file("new.mcap");
  replay::RecordingWriter recording(file);
  recording.addBytes({"camera", "sensor_msgs/msg/Image", ""}, {}, 1000);
  recording.finish();
  for (const bool ros2 : {false, true}) {
    std::vector<std::string> command{perdure(), "record", "export", file, to};
    if (ros2) command.push_back("--ros2");
    test::Child child(command, place.file("log"));
    EXPECT_EQ(child.wait(20s), 65) << child.log();
    EXPECT_THAT(child.log(), HasSubstr("holds no message that can be exported"));
    EXPECT_FALSE(fs::exists(to));
  }
}

TEST(ExportProcess, OnAFullDiskNoFileIsLeft) {
  const test::Folder place;
  fs::create_directories(place.file("small"));
  recordChunks(place.file("run.mcap"));
  const std::string small = place.file("small");
  const std::string script = "mount -t tmpfs -o size=8k own " + small +
                             " && dd if=/dev/zero of=" + small + "/ballast bs=1k 2> /dev/null; " +
                             perdure() + " record export " + place.file("run.mcap") + " " + small +
                             "/new.mcap; echo status $?; ls " + small;
  test::Child child({"unshare", "-m", "sh", "-c", script}, place.file("log"));
  child.wait(20s);
  if (child.log().find("status") == std::string::npos) GTEST_SKIP() << "no right to mount a disk";
  EXPECT_THAT(child.log(), HasSubstr("status 74\nballast\n"));
  EXPECT_THAT(child.log(), Not(HasSubstr("new.mcap\n")));
}

TEST(RepairProcess, AnEmptyFileIsToldToBeEmpty) {
  const test::Folder place;
  const fs::path file = place.file("run.mcap");
  std::ofstream(file).flush();
  for (const char* what : {"info", "repair"}) {
    const Said said = record(what, file);
    EXPECT_EQ(said.status, 69) << what;
    EXPECT_THAT(said.text, HasSubstr("is empty")) << what;
  }
}

}  // namespace
}  // namespace perdure::tools

// Tests tables that need a fix before they can be read: stamps in seconds, orientations among the
// columns.
#include "tools/data_check/repaired_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/tools/data_check/turning_drive.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::Dataset;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using tests::makeTurningDrive;

/// Changes each line of numbers, and replaces all other lines by `head`.
void rewrite(const fs::path& file, const std::function<std::string(const std::string&)>& change,
             const std::string& head = "#other") {
  std::ifstream in(file);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    text += (line.empty() || line[0] == '#' ? head : change(line)) + "\n";
  }
  in.close();
  std::ofstream(file) << text;
}

std::string inSeconds(const std::string& line) {
  const auto at = line.find(',');
  const std::string stamp = line.substr(0, at);
  return stamp.substr(0, stamp.size() - 9) + "." + stamp.substr(stamp.size() - 9) + line.substr(at);
}

void expectSound(const RepairedText& text) {
  const auto recording = Dataset::open({.path = text.drive()})->recording();
  const auto sound = Dataset::open({.path = makeTurningDrive("text_sound")})->recording();
  ASSERT_EQ(recording.imu.size(), sound.imu.size());
  for (std::size_t i = 0; i < sound.imu.size(); ++i) {
    EXPECT_EQ(recording.imu[i].time, sound.imu[i].time);
    EXPECT_EQ(recording.imu[i].gyro, sound.imu[i].gyro);
    EXPECT_EQ(recording.imu[i].accel, sound.imu[i].accel);
  }
  ASSERT_EQ(recording.frames.size(), sound.frames.size());
  EXPECT_EQ(recording.frames.back().time, sound.frames.back().time);
  EXPECT_TRUE(fs::exists(recording.frames.back().path));
}

TEST(RepairedText, SoundFoldersAreLeftAlone) {
  const auto root = makeTurningDrive("text");
  const RepairedText text(root);
  EXPECT_EQ(text.drive(), root);
  EXPECT_THAT(text.fixes(), IsEmpty());
}

TEST(RepairedText, WholeMillisecondsAreKnownByTheRatesOfImuAndCamera) {
  const auto root = makeTurningDrive("text_whole_ms");
  for (const char* sensor : {"cam0", "imu0"}) {
    rewrite(root / "mav0" / sensor / "data.csv", [](const std::string& line) {
      const auto at = line.find(',');
      return line.substr(0, at - 6) + line.substr(at);
    });
  }
  const RepairedText text(root);
  EXPECT_THAT(text.fixes(), testing::Each(HasSubstr("they were milliseconds")));
  EXPECT_EQ(text.fixes().size(), 2U);
  expectSound(text);
}

TEST(RepairedText, SecondsWhoseDecimalsLackZerosAreRefused) {
  const auto root = makeTurningDrive("text_unpadded");
  for (const char* sensor : {"imu0", "cam0"}) {
    rewrite(root / "mav0" / sensor / "data.csv", [](const std::string& line) {
      const std::string text = inSeconds(line);
      const auto dot = text.find('.') + 1, end = text.find(',');
      const auto zeros = text.find_first_not_of('0', dot);
      return text.substr(0, dot) + text.substr(std::min(zeros, end - 1));
    });
  }
  EXPECT_THAT(replay::startupErrorOf([&] { const RepairedText text(root); }),
              HasSubstr("lack their leading zeros"));
}

TEST(RepairedText, StampsInSecondsBecomeNanosecondsExactly) {
  const auto root = makeTurningDrive("text_seconds");
  rewrite(root / "mav0/imu0/data.csv", inSeconds);
  EXPECT_THROW(Dataset::open({.path = root}), StartupError);
  fs::path gone;
  {
    const RepairedText text(root);
    EXPECT_THAT(text.fixes(), ElementsAre(HasSubstr("they were seconds")));
    expectSound(text);
    gone = text.drive();
  }
  EXPECT_FALSE(fs::exists(gone));
  // Also changes the camera's stamps, and gives the folder as mav0/.
  rewrite(root / "mav0/cam0/data.csv", inSeconds);
  const RepairedText both(root / "mav0/");
  EXPECT_EQ(both.fixes().size(), 2U);
  expectSound(both);
}

TEST(RepairedText, StampsInSecondsMayHaveAnExponent) {
  const auto root = makeTurningDrive("text_exponent");
  const auto file = root / "mav0/imu0/data.csv";
  rewrite(file, [](const std::string& line) {  // 1234567890 becomes 1.234567890e+00
    const auto at = line.find(',');
    const std::string stamp = line.substr(0, at);
    return stamp.substr(0, 1) + "." + stamp.substr(1) + "e+" + std::to_string(stamp.size() - 10) +
           line.substr(at);
  });
  {
    const RepairedText text(root);
    EXPECT_THAT(text.fixes(), ElementsAre(HasSubstr("they were seconds")));
    expectSound(text);
  }
  std::ofstream(file, std::ios::app) << "-1.5e+00,0,0,0,0,0,9.8\n";
  try {
    const RepairedText negative(root);
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_THAT(e.what(), HasSubstr(file.string()));
    EXPECT_THAT(e.what(), HasSubstr("`-1.5e+00` is no such stamp"));
  }
}

TEST(RepairedText, AQuaternionAmongTheColumnsIsLeftOut) {
  const auto root = makeTurningDrive("text_quaternion");
  rewrite(root / "mav0/imu0/data.csv", [](const std::string& line) {
    const auto at = line.find(',');
    return line.substr(0, at) + ",0.6,0,0.8,0" + line.substr(at);
  });
  const RepairedText text(root);
  EXPECT_THAT(text.fixes(), ElementsAre(HasSubstr("columns 6, 7, 8, 9, 10, 11 are taken")));
  expectSound(text);
  // Accelerations in g: no group of three columns measures gravity in m/s².
  rewrite(root / "mav0/imu0/data.csv", [](const std::string& line) {
    return line.substr(0, line.find(',')) + ",0.6,0,0.8,0,0.1,0.2,0.3,0,0.1,1";
  });
  EXPECT_THROW(RepairedText{root}, StartupError);
}

TEST(RepairedText, AxesInAnotherOrderAreRefused) {
  const auto root = makeTurningDrive("text_axes");
  rewrite(
      root / "mav0/imu0/data.csv", [](const std::string& line) { return line + ",0"; },
      "#timestamp,w_z [rad/s],w_y [rad/s],w_x [rad/s],a_x,a_y,a_z,roll");
  try {
    const RepairedText text(root);
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_THAT(e.what(), HasSubstr("`w_z [rad/s]` stands where the axis x is awaited"));
  }
}

TEST(RepairedText, TenColumnsNeedAHeadThatNamesThem) {
  const auto ten = [](const std::string& line) {  // accelerations, angles, rates of turn
    std::istringstream in(line);
    std::vector<std::string> words;
    for (std::string word; std::getline(in, word, ',');) words.push_back(word);
    return words[0] + "," + words[4] + "," + words[5] + "," + words[6] + ",0.1,0.2,0.3," +
           words[1] + "," + words[2] + "," + words[3];
  };
  const auto root = makeTurningDrive("text_ten");
  const auto file = root / "mav0/imu0/data.csv";
  rewrite(file, ten, "#timestamp,a_x,a_y,a_z,roll,pitch,yaw,w_x,w_y,w_z");
  const RepairedText text(root);
  EXPECT_THAT(text.fixes(), ElementsAre(HasSubstr("8, 9, 10, 2, 3, 4")));
  expectSound(text);
  rewrite(
      file, [](const std::string& line) { return line; }, "#numbers");
  try {
    const RepairedText unsure(root);
    FAIL() << "it was taken";
  } catch (const StartupError& e) {
    EXPECT_THAT(e.what(), HasSubstr("Name all of them in its first line"));
    EXPECT_EQ(e.code(), ExitCode::kData);
  }
}

}  // namespace
}  // namespace perdure::tools

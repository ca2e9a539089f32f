// Folders in EuRoC's layout as other tools write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>

#include "common/base/errors.h"
#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

std::string errorOfFolder(const fs::path& path) {
  return startupErrorOf([&] { Dataset::open({.path = path}); });
}

struct Given {
  std::size_t samples = 0, frames = 0;
  bool ordered = true;
};
/// Reads the dataset to its end.
Given givenBy(Dataset& dataset) {
  Given given;
  TimePoint last;
  while (auto message = dataset.next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    const TimePoint time = frame ? frame->stamp.time : std::get<ImuSample>(*message).time;
    given.ordered = given.ordered && time >= last;
    last = time;
    ++(frame ? given.frames : given.samples);
  }
  return given;
}
void expectAll(const fs::path& root, std::size_t frames = 5, std::size_t samples = 61) {
  const auto dataset = Dataset::open({.path = root});
  const Given given = givenBy(*dataset);
  EXPECT_EQ(given.frames, frames);
  EXPECT_EQ(given.samples, samples);
  EXPECT_TRUE(given.ordered);
}

/// Changes the lines of a text file one by one, except the first.
void changeLines(const fs::path& file,
                 const std::function<std::string(std::size_t, std::string)>& to) {
  std::istringstream lines(readText(file));
  std::string line, text;
  for (std::size_t i = 0; std::getline(lines, line); ++i) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    text += (i == 0 ? line : to(i, line)) + "\n";
  }
  writeText(file, text);
}
void shuffleLines(const fs::path& file) {
  std::istringstream lines(readText(file));
  std::vector<std::string> all;
  std::string head, line;
  std::getline(lines, head);
  while (std::getline(lines, line)) all.push_back(line);
  std::mt19937_64 random(1);
  std::shuffle(all.begin(), all.end(), random);
  for (const auto& one : all) head += "\n" + one;
  writeText(file, head + "\n");
}
void replaceIn(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = readText(file);
  text.replace(text.find(from), from.size(), to);
  writeText(file, text);
}

TEST(ForeignFolder, ImagesAreFoundByStemOrStamp) {
  for (const int how : {0, 1, 2, 3}) {
    const auto root = tinyEuroc("names_" + std::to_string(how));
    changeLines(root / "mav0/cam0/data.csv", [&](std::size_t, const std::string& line) {
      const std::string stamp = line.substr(0, line.find(','));
      const std::string names[] = {stamp, "data/" + stamp + ".png", stamp + ".jpg", ""};
      return names[how].empty() ? stamp : stamp + "," + names[how];
    });
    expectAll(root);
    const auto dataset = Dataset::open({.path = root});
    EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("5 of 5 images")));
  }
}

TEST(ForeignFolder, WhereNoNameAgreesBothAreShown) {
  const auto root = tinyEuroc("no_name_agrees");
  changeLines(root / "mav0/cam0/data.csv", [](std::size_t i, const std::string& line) {
    return line.substr(0, line.find(',')) + ",left" + std::to_string(i) + ".png";
  });
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    fs::rename(entry.path(), root / "mav0/cam0/data" / ("x" + entry.path().filename().string()));
  }
  EXPECT_THAT(errorOfFolder(root), AllOf(HasSubstr("names 5 images"), HasSubstr("holds 5"),
                                         HasSubstr("`left1.png`"), HasSubstr("`x1000000000.png`")));
}

TEST(ForeignFolder, ListsThatAreNotSortedAre) {
  const auto root = tinyEuroc("unsorted");
  shuffleLines(root / "mav0/cam0/data.csv");
  shuffleLines(root / "mav0/imu0/data.csv");
  expectAll(root);
  const auto dataset = Dataset::open({.path = root});
  EXPECT_GT(dataset->reasons().of("imu_unsorted"), 30U);
  EXPECT_GT(dataset->reasons().of("frame_unsorted"), 0U);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("were sorted")));
}

TEST(ForeignFolder, OneStampFarAheadCostsOneSampleAndOneFrame) {
  const auto root = tinyEuroc("stray");
  changeLines(root / "mav0/imu0/data.csv", [](std::size_t i, const std::string& line) {
    return i == 20 ? "9999999999999" + line.substr(line.find(',')) : line;
  });
  changeLines(root / "mav0/cam0/data.csv", [](std::size_t i, const std::string& line) {
    return i == 2 ? "99999999999999" + line.substr(line.find(',')) : line;
  });
  expectAll(root, 4, 60);
  const auto dataset = Dataset::open({.path = root});
  EXPECT_EQ(dataset->reasons().of("imu_stray"), 1U);
  EXPECT_EQ(dataset->reasons().of("frame_stray"), 1U);
  EXPECT_FALSE(dataset->frameTime(1));
  EXPECT_EQ(toNanoseconds(*dataset->frameTime(2)), 1'100'000'000) << "others keep their numbers";
}

TEST(ForeignFolder, StampsWithAPointOrAsNumpyPrintsThemAreRead) {
  const auto root = tinyEuroc("spelled");
  changeLines(root / "mav0/cam0/data.csv", [](std::size_t, const std::string& line) {
    return line.substr(0, line.find(',')) + ".0" + line.substr(line.find(','));
  });
  changeLines(root / "mav0/imu0/data.csv", [](std::size_t, std::string line) {
    std::string stamp = line.substr(0, line.find(','));
    const auto power = std::to_string(stamp.size() - 1);
    stamp.insert(1, ".");
    line = stamp + "e+" + power + line.substr(line.find(','));
    std::replace(line.begin(), line.end(), ',', ';');
    return line;
  });
  expectAll(root);
}

TEST(ForeignFolder, StampsInSecondsAreNamedByLine) {
  const auto root = tinyEuroc("seconds");
  changeLines(root / "mav0/imu0/data.csv", [](std::size_t i, const std::string& line) {
    return "1000000000." + std::to_string(1000000 + i) + line.substr(line.find(','));
  });
  EXPECT_THAT(errorOfFolder(root),
              AllOf(HasSubstr("imu0/data.csv:2:"), HasSubstr("looks like seconds")));
}

TEST(ForeignFolder, TenColumnsAreRefusedAndSevenNamed) {
  const auto root = tinyEuroc("ten_columns");
  changeLines(root / "mav0/imu0/data.csv", [](std::size_t, const std::string& line) {
    const auto at = line.find(',');
    return line.substr(0, at) + ",1,0,0,0" + line.substr(at);
  });
  EXPECT_THAT(errorOfFolder(root),
              AllOf(HasSubstr("11 columns"), HasSubstr("seven columns are awaited")));
}

TEST(ForeignFolder, DecimalCommasBetweenCommasAreNamed) {
  const auto root = tinyEuroc("decimal_commas");
  changeLines(root / "mav0/imu0/data.csv", [](std::size_t, const std::string& line) {
    return line.substr(0, line.find(',')) + ",0,1,-0,2,0,3,9,7,0,5,-0,5";
  });
  EXPECT_THAT(errorOfFolder(root), HasSubstr("13 columns: the numbers have decimal commas"));
}

TEST(ForeignFolder, AHeadThatNamesAccelerationsFirstIsBelieved) {
  const auto root = tinyEuroc("force_first");
  const auto file = root / "mav0/imu0/data.csv";
  changeLines(file, [](std::size_t, const std::string& line) {
    return line.substr(0, line.find(',')) + ",9.7,0.5,-0.5,0.1,0.2,0.3";
  });
  EXPECT_THAT(checkImuUnits(Dataset::open({.path = root})->recording().imu),
              Contains(testing::Field(&DataFinding::code, "imu_columns_exchanged")));
  replaceIn(file, "w x,w y,w z,a x,a y,a z", "ax,ay,az,wx,wy,wz");
  const auto dataset = Dataset::open({.path = root});
  EXPECT_EQ(dataset->recording().imu[0].accel, Eigen::Vector3d(9.7, 0.5, -0.5));
  EXPECT_EQ(dataset->recording().imu[0].gyro, Eigen::Vector3d(0.1, 0.2, 0.3));
}

TEST(ForeignFolder, ARecordingBesideTheSensorsIsAnotherDrive) {
  const auto root = tinyEuroc("beside");
  writeText(root / "b.db3", "");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = root}); }),
              HasSubstr("holds two recordings, the folder mav0 and b.db3"));
  EXPECT_EQ(startupErrorOf([&] { Dataset::open({.path = root / "mav0"}); }), "");
}

TEST(ForeignFolder, ASlashBehindMav0ChangesNothing) { expectAll(tinyEuroc("slash") / "mav0/"); }

TEST(ForeignFolder, ARigStandsForMissingSensorFiles) {
  const auto root = tinyEuroc("by_rig");
  const auto calibration = Dataset::open({.path = root})->calibration();
  std::string rig;
  for (const char* sensor : {"cam0", "imu0"}) {
    rig += std::string(sensor) + ":\n";
    std::istringstream lines(readText(root / "mav0" / sensor / "sensor.yaml"));
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with('%') && !line.starts_with('#')) rig += "  " + line + "\n";
    }
    fs::remove(root / "mav0" / sensor / "sensor.yaml");
  }
  writeText(root / "rig.yaml", rig);
  const auto dataset = Dataset::open({.path = root, .rig = root / "rig.yaml"});
  EXPECT_EQ(givenBy(*dataset).frames, 5U);
  EXPECT_EQ(dataset->calibration().cameras[0].fx, calibration.cameras[0].fx);
  EXPECT_TRUE(dataset->calibration().cameras[0].T_BC.p.isApprox(calibration.cameras[0].T_BC.p));
  EXPECT_EQ(dataset->calibration().imu->rate_hz, 200.0);
}

TEST(ForeignFolder, KalibrsResultsBesideTheFolderAreItsCalibration) {
  const auto root = tinyEuroc("kalibr_beside");
  const auto before = Dataset::open({.path = root})->calibration();
  for (const char* sensor : {"cam0", "imu0"}) fs::remove(root / "mav0" / sensor / "sensor.yaml");
  writeText(root / "dso/camchain.yaml",
            "cam0:\n  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.2]\n  - [0.0, 0.0, -1.0, 0.3]\n"
            "  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 0.0, 0.0, 1.0]\n"
            "  cam_overlaps: []\n  camera_model: pinhole\n"
            "  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]\n  distortion_model: radtan\n"
            "  intrinsics: [20.0, 21.0, 16.0, 12.0]\n  resolution: [32, 24]\n"
            "  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.004\n");
  writeText(root / "dso/imu_config.yaml",
            "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"
            "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 1.9e-5\n"
            "rostopic: /imu0\nupdate_rate: 200.0\n");
  const auto dataset = Dataset::open({.path = root});
  const CameraCalibration &a = before.cameras[0], &b = dataset->calibration().cameras[0];
  EXPECT_LT(boxMinus(a.T_BC, b.T_BC).norm(), 1e-12) << "T_cam_imu is the inverse of T_BS";
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(a.distortion_coefficients, b.distortion_coefficients);
  EXPECT_EQ(b.time_offset_s, 0.004);
  EXPECT_NEAR(b.rate_hz, 20.0, 1e-6) << "by its stamps";
  EXPECT_EQ(dataset->calibration().imu->accel_bias_walk, before.imu->accel_bias_walk);
  EXPECT_TRUE(dataset->recording().notes.empty());
  // A file without an IMU, and a second camera chain.
  writeText(root / "simulation.yaml", "scene: lap\n");
  writeText(root / "dso/camchain-old.yaml",
            readText(root / "dso/camchain.yaml") + "  line_delay_nanoseconds: 30000\n");
  const auto two = Dataset::open({.path = root});
  ASSERT_EQ(two->recording().notes.size(), 1U);
  EXPECT_THAT(two->recording().notes[0],
              AllOf(HasSubstr("camchain-old.yaml, not of "), HasSubstr("dso/camchain.yaml")));
  const auto& camera = two->calibration().cameras[0];
  EXPECT_NEAR(camera.readout_s, 30e-6 * camera.height, 1e-12);
}

TEST(ForeignFolder, UnknownKeysAreSaid) {
  const auto root = tinyEuroc("unknown_key");
  replaceIn(root / "mav0/cam0/sensor.yaml", "rate_hz:", "framerate: 3\nrate_hz:");
  EXPECT_THAT(Dataset::open({.path = root})->recording().notes,
              Contains(HasSubstr("`framerate` is not known")));
}

TEST(ForeignFolder, ImagesOfTwelveBitsAreScaledByWhatTheyUse) {
  const auto root = tinyEuroc("twelve_bits");
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    writeDeepImage(entry.path(), 32, 24, 12);
  }
  const auto dataset = Dataset::open({.path = root});
  const auto frame = dataset->frameAt(2);
  ASSERT_TRUE(frame);
  const auto& pixels = *frame->data;
  EXPECT_EQ(*std::max_element(pixels.begin(), pixels.end()), 255);
  EXPECT_EQ(*std::min_element(pixels.begin(), pixels.end()), 0);
}

}  // namespace
}  // namespace perdure::replay

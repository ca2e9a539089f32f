#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/camera/camera_model.h"
#include "common/replay/clock_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/kitti_labels.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string errorOfKitti(const DatasetOptions& options) {
  return startupErrorOf([&] { Dataset::open(options); });
}

TEST(KittiCalibration, BodyToPixelIsTheProductOfTheFiles) {
  const auto root = tinyKittiTracking("product");
  auto calibration = readTrackingCalibration(root / "calib/0000.txt");
  calibration.width = 48, calibration.height = 16;
  const Eigen::Vector3d point_B(20.0, 0.3, 0.9);
  for (const auto& [name, P] :
       {std::pair("cam0", calibration.P2), std::pair("cam1", calibration.P3)}) {
    const CameraModel camera(calibration.camera(name));
    const Eigen::Vector3d expected = P * (calibration.T_RI * point_B).homogeneous();
    const auto pixel = camera.project(camera.T_BC().inverse() * point_B);
    ASSERT_TRUE(pixel);
    EXPECT_TRUE(pixel->isApprox(expected.hnormalized(), 1e-9)) << name;
  }
}

TEST(KittiCalibration, TheOfficialNamesWithoutColonsAreKnownToo) {
  const auto root = tinyKittiTracking("official");
  const auto file = root / "calib/0000.txt";
  const auto before = readTrackingCalibration(file);
  std::string text = readText(file);
  text.replace(text.find("R0_rect:"), 8, "R_rect");
  text.replace(text.find("Tr_velo_to_cam:"), 15, "Tr_velo_cam");
  text.replace(text.find("Tr_imu_to_velo:"), 15, "Tr_imu_velo");
  writeText(file, text);
  EXPECT_TRUE(readTrackingCalibration(file).T_RI.p.isApprox(before.T_RI.p));
}

TEST(KittiCalibration, AMissingOrShortEntryIsNamed) {
  const auto file = tinyKittiTracking("short") / "calib/0000.txt";
  const std::string good = readText(file);
  writeText(file, good.substr(0, good.find("Tr_imu")));
  EXPECT_THAT(startupErrorOf([&] { readTrackingCalibration(file); }),
              HasSubstr("Tr_imu_to_velo is missing"));
  writeText(file, good.substr(0, good.size() - 6));
  EXPECT_THAT(startupErrorOf([&] { readTrackingCalibration(file); }),
              HasSubstr("Tr_imu_to_velo has 11"));
}

/// Returns the error of the calibration after one of its numbers is replaced.
std::string complaintOf(const std::string& number, const std::string& other) {
  const auto file = tinyKittiTracking("damaged") / "calib/0000.txt";
  std::string text = readText(file);
  text.replace(text.find(number), number.size(), other);
  writeText(file, text);
  return startupErrorOf([&] { readTrackingCalibration(file); });
}

TEST(KittiCalibration, WhatIsNoProjectionOrNoRotationIsNamed) {
  EXPECT_THAT(complaintOf("P2: 700", "P2: 0"), HasSubstr("P2 is no projection"));
  EXPECT_THAT(complaintOf("P2: 700", "P2: 1e300"), HasSubstr("P2 is no projection"));
  EXPECT_THAT(complaintOf("8 0.7 0 0 1 0", "8 0.7 0 0 0 0"), HasSubstr("P2 is no projection"));
  EXPECT_THAT(complaintOf("R0_rect: 1", "R0_rect: -1"), HasSubstr("R0_rect is no rotation"));
  EXPECT_THAT(complaintOf("velo: 1 0", "velo: 1 0.1"), HasSubstr("Tr_imu_to_velo is no rotation"));
}

TEST(KittiCalibration, AnImageHasASize) {
  const auto drive = tinyKittiRaw("sizes");
  const auto file = drive.parent_path() / "calib_cam_to_cam.txt";
  const std::string text = readText(file);
  for (const std::string size : {"-48 16", "0 16", "48 1e10"}) {
    std::string damaged = text;
    damaged.replace(damaged.find("48 16"), 5, size);
    writeText(file, damaged);
    EXPECT_THAT(startupErrorOf([&] { readRawCalibration(drive.parent_path()); }),
                HasSubstr("S_rect_02 is no size"))
        << size;
  }
}

TEST(KittiRaw, OxtsComesAsInertialSamplesAndSpeedOfTheBody) {
  const auto dataset = Dataset::open({.path = tinyKittiRaw("oxts")});
  EXPECT_EQ(dataset->kind(), DatasetKind::kKittiRaw);
  EXPECT_TRUE(dataset->calibration().has_speed);
  std::vector<ImuSample> imu;
  std::vector<SpeedSample> speed;
  while (auto message = dataset->next()) {
    if (auto* sample = std::get_if<ImuSample>(&*message)) imu.push_back(*sample);
    if (auto* sample = std::get_if<SpeedSample>(&*message)) speed.push_back(*sample);
  }
  ASSERT_EQ(imu.size(), 4U);
  EXPECT_TRUE(imu[0].accel.isApprox(Eigen::Vector3d(0.1, 0.2, 9.8))) << "ax ay az, not af al au";
  EXPECT_TRUE(imu[0].gyro.isApprox(Eigen::Vector3d(0.01, 0.02, 0.03))) << "wx wy wz";
  EXPECT_EQ(speed[3].speed, 6.0);
  EXPECT_EQ(speed[3].time, imu[3].time);
}

/// Replaces a line of a file by an empty one.
void emptyLine(const fs::path& file, std::size_t number) {
  std::string text = readText(file);
  std::size_t begin = 0;
  for (; number > 1; --number) begin = text.find('\n', begin) + 1;
  text.erase(begin, text.find('\n', begin) - begin);
  writeText(file, text);
}

TEST(KittiRaw, AnEmptyStampCostsItsRecordAndNotTheOnesBehind) {
  const auto drive = tinyKittiRaw("empty_line");
  const auto whole = Dataset::open({.path = drive});
  const auto third = *whole->frameTime(2), fourth = *whole->frameTime(3);
  emptyLine(drive / "image_02/timestamps.txt", 2);
  emptyLine(drive / "oxts/timestamps.txt", 2);
  const auto dataset = Dataset::open({.path = drive});
  EXPECT_FALSE(dataset->frameTime(1));
  EXPECT_EQ(dataset->frameTime(2), third);
  EXPECT_EQ(dataset->frameTime(3), fourth);
  EXPECT_EQ(dataset->reasons().of("imu_malformed"), 1U);
  ASSERT_EQ(dataset->recording().speed.size(), 3U);
  EXPECT_EQ(dataset->recording().speed[1].speed, 5.0) << "the third record's own";
  EXPECT_EQ(dataset->recording().speed[1].time, whole->recording().speed[2].time);
}

TEST(KittiRaw, AStampOfNoTimeOfDayIsNone) {
  for (const char* stamp :
       {"24:04:32.1", "13:60:32.1", "13:04:61.1", "-1:04:32.1", "13:04:32.-1", "2147483647:0:0"}) {
    const auto drive = tinyKittiRaw("no_time");
    const auto file = drive / "image_02/timestamps.txt";
    std::string text = readText(file);
    text.replace(text.find("13:04:32.1"), 10, stamp);
    writeText(file, text);
    EXPECT_EQ(Dataset::open({.path = drive})->reasons().of("frame_malformed"), 1U) << stamp;
  }
}

TEST(KittiRaw, StampsAreAsWrittenAndThePairSharesTheLeftOnes) {
  const auto dataset =
      Dataset::open({.path = tinyKittiRaw("stamps"), .second_encoding = ImageEncoding::kMono8});
  ASSERT_EQ(dataset->calibration().cameras.size(), 2U);
  EXPECT_EQ(dataset->frameCount(), 4U);
  // 2011-09-26 13:04:32.1 UTC
  EXPECT_EQ(toNanoseconds(*dataset->frameTime(0)), 1317042272100000000);
  const auto left = std::get<Frame>(*dataset->next()), right = std::get<Frame>(*dataset->next());
  EXPECT_EQ(left.camera, "cam0");
  EXPECT_EQ(left.encoding, ImageEncoding::kBgr8);
  EXPECT_EQ(right.camera, "cam1");
  EXPECT_EQ(right.encoding, ImageEncoding::kMono8);
  EXPECT_EQ(right.stamp.time, left.stamp.time);
  const auto imu = std::get<ImuSample>(*dataset->next());
  EXPECT_EQ(imu.time - left.stamp.time, std::chrono::milliseconds(7));
}

TEST(KittiRaw, AClockThatWasSetIsOneStepForBothCameras) {
  const auto drive = tinyKittiRaw("set");
  std::string stamps;
  for (int i = 0; i < 60; ++i) {
    const int ms = 32'000 + 100 * i - (i < 30 ? 0 : 2030);
    stamps += fmt::format("2011-09-26 13:04:{:02}.{:03}000000\n", ms / 1000, ms % 1000);
    if (i < 4) continue;  // they exist
    fs::copy_file(drive / "oxts/data/0000000000.txt",
                  drive / fmt::format("oxts/data/{:010}.txt", i));
  }
  writeText(drive / "image_02/timestamps.txt", stamps);
  writeText(drive / "oxts/timestamps.txt", stamps);
  const auto dataset = Dataset::open({.path = drive});
  const auto findings = checkClocks(dataset->recording(), {});
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "clock_set");
  EXPECT_THAT(findings[0].text, HasSubstr("image_02/timestamps.txt:31"));
  EXPECT_EQ(dataset->recording().frames.size(), 120U);
}

TEST(KittiRaw, TheFirstOxtsRecordAnchorsTheDriveOnEarth) {
  const auto dataset = Dataset::open({.path = tinyKittiRaw("anchor")});
  ASSERT_TRUE(dataset->calibration().anchor);
  EXPECT_EQ(dataset->calibration().anchor->latitude_deg, 49.01);
  EXPECT_EQ(dataset->calibration().anchor->yaw, -1.22);
}

TEST(KittiRaw, OxtsGivesTheTrueWayEastNorthAndUp) {
  const auto drive = tinyKittiRaw("way");
  const std::string record = readText(drive / "oxts/data/0000000002.txt");
  writeText(drive / "oxts/data/0000000002.txt", "49.0101 8.4202 113.8 0 0 1.5" + record.substr(33));
  const auto dataset = Dataset::open({.path = drive});
  ASSERT_TRUE(dataset->truth());
  const auto& poses = dataset->truth()->poses();
  ASSERT_EQ(poses.size(), 4U);
  EXPECT_TRUE(poses[0].T_WB.p.isZero());
  // One degree of a great circle with radius 6378137 m is 111319.5 m; one degree of longitude is
  // cos 49.01° of it.
  EXPECT_NEAR(poses[2].T_WB.p.x(), 2e-4 * 111319.5 * std::cos(49.01 * 3.14159265 / 180), 1e-3);
  EXPECT_NEAR(poses[2].T_WB.p.y(), 1e-4 * 111319.5, 1e-3);
  EXPECT_NEAR(poses[2].T_WB.p.z(), 1.0, 1e-9);
  EXPECT_NEAR((poses[2].T_WB.q * Eigen::Vector3d::UnitX()).x(), std::cos(1.5), 1e-9);
}

TEST(KittiRaw, CalibrationBesideOrAboveTheDriveIsFoundAndItsAbsenceNamed) {
  const auto drive = tinyKittiRaw("calibration");
  const auto day = drive.parent_path();
  EXPECT_EQ(Dataset::open({.path = drive / ""})->frameCount(), 4U) << "with a trailing slash";
  for (const char* file :
       {"calib_cam_to_cam.txt", "calib_velo_to_cam.txt", "calib_imu_to_velo.txt"}) {
    fs::rename(day / file, drive / file);
  }
  EXPECT_EQ(Dataset::open({.path = drive})->calibration().cameras[0].fx, 700.0);
  fs::remove(drive / "calib_imu_to_velo.txt");
  EXPECT_THAT(errorOfKitti({.path = drive}), HasSubstr("calib_imu_to_velo.txt"));
  fs::remove(drive / "calib_cam_to_cam.txt");
  EXPECT_THAT(errorOfKitti({.path = drive}), HasSubstr("unpack KITTI's calibration of that day"));
}

TEST(KittiRaw, MissingPartsAreNamed) {
  auto drive = tinyKittiRaw("parts");
  fs::remove_all(drive / "oxts");
  EXPECT_THAT(errorOfKitti({.path = drive}), HasSubstr("oxts/data"));
  drive = tinyKittiRaw("parts");
  fs::remove(drive / "image_02/timestamps.txt");
  EXPECT_THAT(errorOfKitti({.path = drive}), HasSubstr("image_02/timestamps.txt"));
  drive = tinyKittiRaw("parts");
  fs::remove_all(drive / "image_03");
  EXPECT_EQ(Dataset::open({.path = drive})->calibration().cameras.size(), 1U) << "mono is enough";
}

TEST(KittiRaw, BrokenOxtsRecordsAreCountedAndLeftOut) {
  const auto drive = tinyKittiRaw("broken_oxts");
  writeText(drive / "oxts/data/0000000001.txt", "49.0 8.4 nan\n");
  fs::remove(drive / "oxts/data/0000000002.txt");
  const auto dataset = Dataset::open({.path = drive});
  EXPECT_EQ(dataset->reasons().of("imu_malformed"), 1U);
  EXPECT_EQ(dataset->reasons().of("imu_missing"), 1U);
}

TEST(KittiTracking, ASequenceWithImagesTakesTheirSizeAndCount) {
  const auto root = tinyKittiTracking("images");
  const auto dataset = Dataset::open({.path = root, .sequence = "0000"});
  EXPECT_EQ(dataset->frameCount(), 3U);
  EXPECT_EQ(dataset->calibration().cameras[0].width, 48U);
  const auto frame = std::get<Frame>(*dataset->next());
  EXPECT_EQ(toNanoseconds(frame.stamp.time), 0);
  ASSERT_TRUE(frame.data);
  EXPECT_EQ(toNanoseconds(std::get<Frame>(*dataset->next()).stamp.time), 100'000'000);
}

TEST(KittiTracking, WithoutImagesFramesCarryStampAndSizeOnly) {
  const auto root = tinyKittiTracking("no_images");
  const auto dataset = Dataset::open({.path = root, .sequence = "0001"});
  EXPECT_EQ(dataset->frameCount(), 5U) << "the labels end at frame 4";
  const auto frame = std::get<Frame>(*dataset->next());
  EXPECT_FALSE(frame.data);
  EXPECT_EQ(frame.width, 1242U);
  EXPECT_EQ(frame.height, 375U);
  const auto sized = Dataset::open(
      {.path = root, .sequence = "0001", .image_size = std::pair(640U, 480U), .frame_count = 9});
  EXPECT_EQ(sized->calibration().cameras[0].width, 640U);
  EXPECT_EQ(sized->frameCount(), 9U);
}

TEST(KittiTracking, WhatIsMissingIsNamed) {
  const auto root = tinyKittiTracking("tracking_missing");
  EXPECT_THAT(errorOfKitti({.path = root}), HasSubstr("name one with --sequence (0000, 0001)"));
  EXPECT_THAT(errorOfKitti({.path = root, .sequence = "0042"}), HasSubstr("there are 0000, 0001"));
  fs::remove_all(root / "label_02");
  EXPECT_THAT(errorOfKitti({.path = root, .sequence = "0001"}), HasSubstr("one line a frame"));
  fs::remove_all(root / "calib");
  fs::create_directories(root / "label_02");
  EXPECT_THAT(errorOfKitti({.path = root, .sequence = "0000"}),
              HasSubstr("unpack KITTI tracking's calib"));
}

TEST(KittiTracking, KnownSizesOfTheTrainingSequences) {
  EXPECT_EQ(trackingImageSize("0000").width, 1242U);
  EXPECT_EQ(trackingImageSize("0017").height, 370U);
  EXPECT_EQ(trackingImageSize("0018").width, 1238U);
  EXPECT_EQ(trackingImageSize("0020").height, 376U);
}

TEST(KittiLabels, TheCentreIsHalfTheHeightAboveTheBottom) {
  const auto labels = readKittiLabels(tinyKittiTracking("labels") / "label_02/0001.txt");
  ASSERT_EQ(labels.size(), 2U);
  EXPECT_TRUE(labels[0].centre.isApprox(Eigen::Vector3d(1.0, 0.9, 10.0)));
  EXPECT_EQ(labels[0].length, 4.0);
  EXPECT_EQ(labels[0].track, 3);
  EXPECT_TRUE(labels[1].dontCare());
}

TEST(KittiLabels, WrongLinesAreLocated) {
  const auto file = freshFolder("wrong_labels") / "0000.txt";
  writeText(file,
            "0 1 Car 0 0 0 1 2 3 4 1 1 1 0 0 5 0\n0 1 Car\n0 x Car 0 0 0 1 2 3 4 1 1 1 0 0 5 0\n");
  const auto error = startupErrorOf([&] { readKittiLabels(file); });
  EXPECT_THAT(error, HasSubstr("0000.txt:2: 17 fields"));
  EXPECT_THAT(error, HasSubstr("0000.txt:3: a field is not a number"));
  EXPECT_EQ(startupCodeOf([&] { readKittiLabels(file); }), ExitCode::kData);
}

// Frames up to the last label's number would be allocated, so that large numbers must be refused.
TEST(KittiLabels, AFrameOrACountThatMakesNoSenseIsRefused) {
  const auto file = freshFolder("senseless_labels") / "0000.txt";
  writeText(file,
            "1000000 1 Car 0 0 0 1 2 3 4 1 1 1 0 0 5 0\n0 1e300 Car 0 0 0 1 2 3 4 1 1 1 0 0 5 0\n"
            "0 1 Car 0 -1e10 0 1 2 3 4 1 1 1 0 0 5 0\n999999 1 Car 0 0 0 1 2 3 4 1 1 1 0 0 5 0\n");
  const auto error = startupErrorOf([&] { readKittiLabels(file); });
  for (const char* line : {":1:", ":2:", ":3:"}) EXPECT_THAT(error, HasSubstr(line));
  EXPECT_THAT(error, testing::Not(HasSubstr(":4:")));
}

}  // namespace
}  // namespace perdure::replay

#include "tools/data_check/data_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/tools/data_check/turning_drive.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::DataFinding;
using replay::Dataset;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::makeTurningDrive;
using tests::TurningDrive;

std::vector<std::string> codesOf(const replay::DataFindings& findings) {
  std::vector<std::string> codes;
  for (const auto& finding : findings) codes.push_back(finding.code);
  return codes;
}
replay::DataFindings findingsIn(const fs::path& root) {
  return checkDrive(Dataset::open({.path = root})->recording(), {});
}
replay::DataFindings findingsOf(const std::string& name, const TurningDrive& drive) {
  return findingsIn(makeTurningDrive(name, drive));
}

TEST(DataCheck, ASoundDriveHasNoFinding) {
  EXPECT_THAT(codesOf(findingsOf("sound", {})), ElementsAre());
  TurningDrive still;
  still.turning = 0.0;
  EXPECT_THAT(codesOf(findingsOf("still", still)), ElementsAre());
  TurningDrive biased;
  biased.gyro_bias = {0.1, -0.2, 0.1};  // typical of a low-cost unit
  EXPECT_THAT(codesOf(findingsOf("biased", biased)), ElementsAre());
}

TEST(DataCheck, AnImageThatIsRepeatedWhileTheBodyMovesIsToldWithTheTime) {
  const auto freeze = [](const fs::path& root, std::size_t first, std::size_t last) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data"))
      files.push_back(entry.path());
    std::ranges::sort(files);
    for (std::size_t i = first + 1; i < last; ++i)
      fs::copy_file(files[first], files[i], fs::copy_options::overwrite_existing);
    return findingsIn(root);
  };
  TurningDrive drive;
  drive.seconds = 4.0;
  const auto root = makeTurningDrive("frozen", drive);
  const auto findings = freeze(root, 23, 50);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].code, "images_frozen");
  EXPECT_THAT(findings[0].text, HasSubstr("(1.3 s, images 24 to 50) while the gyroscope turns"));
  EXPECT_THAT(codesOf(freeze(makeTurningDrive("frozen_short", drive), 23, 32)),
              testing::Not(testing::Contains("images_frozen")));
  auto twice = Dataset::open({.path = makeTurningDrive("twice", drive)})->recording();
  for (std::size_t i = 0; i + 1 < twice.frames.size(); i += 2)
    twice.frames[i + 1].path = twice.frames[i].path;
  EXPECT_THAT(codesOf(checkDrive(twice, {})), testing::Contains("images_repeated"));
}

TEST(DataCheck, ImagesTurnAsTheGyroscopeSays) {
  const auto root = makeTurningDrive("turns");
  const auto recording = Dataset::open({.path = root})->recording();
  const auto turns = turnsOfImages(recording, recording.imu);
  ASSERT_GE(turns.size(), 30U);
  double worst = 0.0, largest = 0.0;
  for (const Turn& turn : turns) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i < recording.imu.size(); ++i) {
      if (recording.imu[i].time <= turn.from || recording.imu[i].time > turn.to) continue;
      sum += 0.0025 * (recording.imu[i].gyro + recording.imu[i - 1].gyro);
    }
    sum -= 0.05 * TurningDrive().gyro_bias;
    const Eigen::Vector3d expected = tests::trueCameraPlace().R().transpose() * sum;
    worst = std::max(worst, (turn.of_images - expected).norm());
    largest = std::max(largest, expected.norm());
  }
  EXPECT_GT(largest, 0.03);
  EXPECT_LT(worst, 0.003);
}

TEST(DataCheck, DegreesPerSecondAreSeenByTheImages) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.gyro *= 180.0 / M_PI; };
  const auto findings = findingsOf("degrees", drive);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.back().code, "gyro_in_degrees");
  EXPECT_EQ(findings.back().grade, DataFinding::Grade::kFatal);
  EXPECT_THAT(findings.back().text, HasSubstr("57 times what the images show"));
  drive.change = [](ImuSample& sample) { sample.gyro *= M_PI / 180.0; };
  EXPECT_THAT(codesOf(findingsOf("converted_twice", drive)), ElementsAre("gyro_too_small"));
}

TEST(DataCheck, ImagesThatStandStillAreNoMatterOfUnits) {
  auto recording = Dataset::open({.path = makeTurningDrive("frozen")})->recording();
  for (auto& frame : recording.frames) frame.path = recording.frames.front().path;
  auto findings = checkDrive(recording, {});
  ASSERT_THAT(codesOf(findings), ElementsAre("images_frozen", "images_still"));
  EXPECT_THAT(findings[1].text, HasSubstr("stand still or come again"));
  // An exception: a rate of turn that no carried device reaches.
  for (auto& sample : recording.imu) sample.gyro *= 180.0 / M_PI;
  findings = checkDrive(recording, {});
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.back().code, "gyro_in_degrees");
}

TEST(DataCheck, AGyroscopeThatIsOffIsNoMatterOfUnits) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.gyro.setConstant(0.01); };
  const auto findings = findingsOf("gyro_off", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("gyro_constant"));
  EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
}

TEST(DataCheck, AnAccelerometerOfTheOtherSignTurnsTheImagesUpsideDown) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.accel = -sample.accel; };
  const auto findings = findingsOf("other_sign", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("images_upside_down"));
  EXPECT_THAT(findings[0].text, HasSubstr("signs of the accelerometer"));
}

TEST(DataCheck, AxesOfTheGyroscopeThatAreExchangedAreNamed) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { std::swap(sample.gyro.x(), sample.gyro.y()); };
  const auto exchanged = findingsOf("exchanged_axes", drive);
  ASSERT_THAT(codesOf(exchanged), ElementsAre("gyro_axes"));
  EXPECT_THAT(exchanged[0].text, HasSubstr("w_x = w_y, w_y = w_x, w_z = w_z"));
  EXPECT_EQ(exchanged[0].grade, DataFinding::Grade::kFatal);
}

TEST(DataCheck, AGyroscopeThatSaysTooMuchIsDoubtful) {
  const auto findingsAt = [](double factor) {
    TurningDrive drive;
    drive.change = [=](ImuSample& sample) { sample.gyro *= factor; };
    return findingsOf("factor", drive);
  };
  const auto large = findingsAt(1.2);
  ASSERT_THAT(codesOf(large), ElementsAre("gyro_factor"));
  EXPECT_THAT(large[0].text, testing::ContainsRegex("says 1.(19|20|21) times the turning"));
  EXPECT_THAT(codesOf(findingsAt(0.8)), ElementsAre("gyro_factor"));
  EXPECT_THAT(codesOf(findingsAt(1.06)), ElementsAre("gyro_factor"));
  EXPECT_THAT(codesOf(findingsAt(1.02)), ElementsAre());
}

TEST(DataCheck, AllSignsOfTheGyroscopeAreNamedTogether) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { sample.gyro = -sample.gyro; };
  const auto findings = findingsOf("all_signs", drive);
  // In this oscillating drive, an offset of half a period is an equally good explanation.
  ASSERT_THAT(codesOf(findings), ElementsAre("gyro_axes", "time_offset"));
  EXPECT_THAT(findings[0].text, HasSubstr("w_x = -w_x, w_y = -w_y, w_z = -w_z"));
}

// `doctor --fix` inverts a T_BS only if it is certainly inverted.
TEST(DataCheck, ColumnsInAnotherOrderAreNoInvertedTransform) {
  TurningDrive drive;
  for (const int by : {1, 2}) {
    drive.change = [by](ImuSample& sample) {
      const Eigen::Vector3d w = sample.gyro;
      for (int i = 0; i < 3; ++i) sample.gyro[i] = w[(i + by) % 3];
    };
    const auto codes = codesOf(findingsOf("rolled_axes", drive));
    EXPECT_FALSE(codes.empty()) << by;
    EXPECT_EQ(std::count(codes.begin(), codes.end(), "T_BS_inverted"), 0) << by;
  }
}

TEST(DataCheck, AnAxisOfTheOtherSignIsNamed) {
  for (const Eigen::Index axis : {0, 1, 2}) {
    TurningDrive drive;
    drive.turning = 0.1;
    drive.change = [&](ImuSample& sample) { sample.gyro[axis] = -sample.gyro[axis]; };
    const auto findings = findingsOf("flipped_axis", drive);
    ASSERT_THAT(codesOf(findings), ElementsAre("gyro_axes"));
    EXPECT_EQ(findings[0].grade, DataFinding::Grade::kWarning);
    const char name = "xyz"[axis];
    EXPECT_THAT(findings[0].text, HasSubstr(std::string("w_") + name + " = -w_" + name));
  }
}

TEST(DataCheck, ATransformTheWrongWayRoundIsNamed) {
  TurningDrive drive;
  drive.written_T_BC = tests::trueCameraPlace().inverse();
  const auto findings = findingsOf("inverted", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("T_BS_inverted"));
  EXPECT_EQ(findings[0].grade, DataFinding::Grade::kFatal);
}

TEST(DataCheck, AnIdentityInPlaceOfTheTransformIsDoubtful) {
  TurningDrive drive;
  drive.written_T_BC = RigidTransform();
  const auto findings = findingsOf("identity", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("T_BS_turned"));
  EXPECT_THAT(findings[0].text, HasSubstr("120°"));
}

TEST(DataCheck, ACameraTurnedByMoreThanTwentyDegreesIsDoubtful) {
  const auto findingsAt = [](double degrees) {
    TurningDrive drive;
    const Eigen::Vector3d turn = degrees * M_PI / 180.0 * Eigen::Vector3d(0.6, 0.0, 0.8);
    drive.written_T_BC = tests::trueCameraPlace();
    drive.written_T_BC.q = drive.written_T_BC.q * expQuaternion(turn);
    return findingsOf("turned", drive);
  };
  EXPECT_THAT(codesOf(findingsAt(5.0)), ElementsAre());
  const auto turned = findingsAt(30.0);
  ASSERT_THAT(codesOf(turned), ElementsAre("T_BS_turned"));
  EXPECT_THAT(turned[0].text, testing::ContainsRegex("about (29|30|31)°"));
}

TEST(DataCheck, ImagesThatComeLateAreDoubtful) {
  TurningDrive drive;
  drive.seconds = 3.0;
  drive.images_late = std::chrono::milliseconds(250);
  const auto findings = findingsOf("late", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("time_offset"));
  EXPECT_THAT(findings[0].text, HasSubstr("time_offset_s to -0.25"));
  drive.images_late = std::chrono::milliseconds(100);  // most rotations still fit
  const auto slightly = findingsOf("slightly_late", drive);
  ASSERT_THAT(codesOf(slightly), ElementsAre("time_offset"));
  EXPECT_THAT(slightly[0].text, HasSubstr("time_offset_s to -0.10"));
  drive.images_late = std::chrono::milliseconds(20);
  EXPECT_THAT(codesOf(findingsOf("hardly_late", drive)), ElementsAre()) << "vio estimates it";
}

TEST(DataCheck, HalfAPeriodOfASwingMayBeStampsOrSigns) {
  TurningDrive drive;
  drive.seconds = 6.0;
  drive.images_late = std::chrono::milliseconds(700);
  const auto findings = findingsOf("half_a_period", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("imu_covers_part", "gyro_axes", "time_offset"));
  EXPECT_THAT(findings[1].text, HasSubstr("or see the stamps, which explain it as well"));
  EXPECT_THAT(findings[2].text, HasSubstr("time_offset_s to -0.70"));
}

TEST(DataCheck, AnOffsetBeyondTheSearchGetsNoNumber) {
  const auto findingsAt = [](int late_ms) {
    TurningDrive drive;
    drive.seconds = 6.0;
    drive.images_late = std::chrono::milliseconds(late_ms);
    const auto root = makeTurningDrive("very_late", drive);
    const auto recording = Dataset::open({.path = root})->recording();
    // In this drive, half a period resembles a flipped axis; therefore the axes are not checked.
    return judgeTurns(turnsOfImages(recording, recording.imu), recording.imu,
                      recording.calibration.cameras.front());
  };
  const auto late = findingsAt(700);
  ASSERT_THAT(codesOf(late), ElementsAre("time_offset"));
  EXPECT_THAT(late[0].text, HasSubstr("time_offset_s to -0.70"));
  EXPECT_THAT(codesOf(findingsAt(1050)), testing::Not(testing::Contains("time_offset")))
      << "the search ends at 1 s";
}

/// Returns the drive's true poses by integration of its rates; the times are too large by `late`.
replay::PoseFile posesOf(const replay::Recording& recording, Duration late) {
  std::vector<replay::StampedPose> poses;
  RigidTransform T_WB;
  for (std::size_t i = 0; i < recording.imu.size(); ++i) {
    if (i > 0) {
      const auto &a = recording.imu[i - 1], &b = recording.imu[i];
      const Eigen::Vector3d rate = 0.5 * (a.gyro + b.gyro) - TurningDrive().gyro_bias;
      T_WB.q = T_WB.q * expQuaternion(toSeconds(b.time - a.time) * rate);
    }
    if (i % 4 == 0) poses.push_back({recording.imu[i].time + late, T_WB});
  }
  return {replay::PoseFormat::kTum, poses};
}

TEST(DataCheck, PosesThatAreLateAreDoubtful) {
  TurningDrive drive;
  drive.seconds = 4.0;
  const auto recording = Dataset::open({.path = makeTurningDrive("poses", drive)})->recording();
  const auto findingsAt = [&](int late_ms) {
    return checkPoses(recording, posesOf(recording, std::chrono::milliseconds(late_ms)), {});
  };
  EXPECT_THAT(codesOf(findingsAt(0)), ElementsAre());
  EXPECT_THAT(codesOf(findingsAt(30)), ElementsAre());
  const auto late = findingsAt(300), early = findingsAt(-200);
  ASSERT_THAT(codesOf(late), ElementsAre("poses_time_offset"));
  EXPECT_THAT(late[0].text, HasSubstr("0.30 s before the poses that are given: subtract 0.30 s"));
  ASSERT_THAT(codesOf(early), ElementsAre("poses_time_offset"));
  EXPECT_THAT(early[0].text, HasSubstr("add 0.20 s to"));
}

TEST(DataCheck, WithoutAnImuTheImagesTellHowPosesAreWritten) {
  auto recording = Dataset::open({.path = makeTurningDrive("poses_alone")})->recording();
  auto poses = posesOf(recording, Duration(0)).poses();
  recording.imu.clear();
  const auto findingsWith = [&] {
    return checkPoses(recording, {replay::PoseFormat::kTum, poses}, {.images = false});
  };
  EXPECT_THAT(codesOf(findingsWith()), ElementsAre());
  for (auto& pose : poses) pose.T_WB = pose.T_WB * tests::trueCameraPlace();
  const auto of_camera = findingsWith();
  ASSERT_THAT(codesOf(of_camera), ElementsAre("poses_of_camera"));
  EXPECT_THAT(of_camera[0].text, HasSubstr("otherwise than the images in"));
}

TEST(DataCheck, UnitsOfTheAccelerometerAreToldByGravity) {
  const auto codesAt = [](double factor) {
    std::vector<ImuSample> samples(50);
    for (auto& sample : samples) sample.accel = factor * Eigen::Vector3d(0.3, -0.2, 9.8);
    return codesOf(replay::checkImuUnits(samples));
  };
  EXPECT_THAT(codesAt(1.0), ElementsAre());
  EXPECT_THAT(codesAt(1.0 / 9.80665), ElementsAre("accel_in_g"));
  EXPECT_THAT(codesAt(1000.0 / 9.80665), ElementsAre("accel_in_mg"));
  EXPECT_THAT(codesAt(1000.0), ElementsAre("accel_in_mm"));
  EXPECT_THAT(codesAt(0.01), ElementsAre("accel_without_gravity"));
  EXPECT_THAT(codesAt(1.5), ElementsAre("accel_scale"));
}

// Accelerations without gravity may have any magnitude, also that of g, but no constant direction.
TEST(DataCheck, GravityThatWasTakenAwayIsNoMatterOfUnits) {
  std::vector<ImuSample> samples(200);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = 0.1 * static_cast<double>(i);
    samples[i].accel = {1.5 * std::sin(t), 1.2 * std::cos(1.3 * t), std::sin(0.7 * t)};
  }
  EXPECT_THAT(codesOf(replay::checkImuUnits(samples)), ElementsAre("accel_without_gravity"));
  for (auto& sample : samples) sample.accel = 0.1 * sample.accel + Eigen::Vector3d(0, 0, 1);
  EXPECT_THAT(codesOf(replay::checkImuUnits(samples)), ElementsAre("accel_in_g"));
}

TEST(DataCheck, RatesThatNoBodyReachesAreRefused) {
  std::vector<ImuSample> samples(50);
  for (auto& sample : samples) sample.accel = {0.3, -0.2, 9.8}, sample.gyro = {17'000, 0, 0};
  const auto findings = replay::checkImuUnits(samples);
  ASSERT_THAT(codesOf(findings), ElementsAre("gyro_scale"));
  EXPECT_THAT(findings[0].text, HasSubstr("thousandths of a degree"));
}

TEST(DataCheck, AnImuThatRepeatsOneSampleIsNamed) {
  TurningDrive drive;
  ImuSample stuck;
  std::size_t count = 0;
  drive.change = [&](ImuSample& sample) {
    if (++count == 200) stuck = sample;
    if (count > 200 && count < 300) sample.gyro = stuck.gyro, sample.accel = stuck.accel;
  };
  EXPECT_THAT(codesOf(findingsOf("stuck_imu", drive)), testing::Contains("imu_repeats"));
}

TEST(DataCheck, ExchangedColumnsAreToldByGravity) {
  TurningDrive drive;
  drive.change = [](ImuSample& sample) { std::swap(sample.gyro, sample.accel); };
  const auto findings = findingsOf("exchanged", drive);
  ASSERT_THAT(codesOf(findings), ElementsAre("imu_columns_exchanged"));
  EXPECT_THAT(replay::startupErrorOf([&] { replay::refuseFatal(findings, "DRIVE"); }),
              HasSubstr("DRIVE: what should be rates of turn"));
}

/// Changes the IMU stamps of a drive and returns the findings.
replay::DataFindings findingsWithStamps(const std::string& name,
                                        const std::function<std::int64_t(std::int64_t)>& change) {
  const auto root = makeTurningDrive(name);
  auto recording = Dataset::open({.path = root})->recording();
  for (auto& sample : recording.imu) {
    sample.time = fromNanoseconds(change(toNanoseconds(sample.time)));
  }
  return replay::checkData(recording, {});
}

TEST(DataCheck, ClocksThatDoNotOverlapAreShownWithTheirUnit) {
  auto findings = findingsWithStamps("epoch", [](auto ns) { return ns - 900'000'000'000'000'000; });
  ASSERT_THAT(codesOf(findings), ElementsAre("clocks_apart"));
  EXPECT_THAT(findings[0].text, HasSubstr("900000000 s apart"));
  findings = findingsWithStamps("micro", [](auto ns) { return ns / 1000; });
  EXPECT_EQ(findings[0].code, "clocks_apart");
  EXPECT_THAT(findings[0].text, HasSubstr("look like microseconds: multiply them by 1000"));
}

TEST(DataCheck, ImagesOfAnotherSizeThanTheCalibrationAreNamedWithBoth) {
  const auto root = replay::tinyEuroc("other_size");
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    replay::writeImage(entry.path(), 24, 32, 1);
  }
  const auto findings = findingsIn(root);
  ASSERT_THAT(codesOf(findings), ElementsAre("image_size"));
  EXPECT_THAT(findings[0].text, HasSubstr("cam0 are 24x32, its calibration is for 32x24"));
  EXPECT_TRUE(checkDrive(Dataset::open({.path = root})->recording(), {.images = false}).empty());
}

TEST(DataCheck, OneImageOfAnotherSizeIsNoReasonToStop) {
  const auto root = replay::tinyEuroc("one_other_size");
  replay::writeImage(root / "mav0/cam0/data/1000000000.png", 24, 32, 1);
  EXPECT_THAT(codesOf(findingsIn(root)), ElementsAre());
}

TEST(DataCheck, ImagesOfOneGreyAreDoubtful) {
  const auto root = replay::tinyEuroc("one_grey");
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data")) {
    replay::writeGrey(entry.path(), 32, 24, 40);
  }
  EXPECT_THAT(codesOf(findingsIn(root)), ElementsAre("image_flat"));
}

}  // namespace
}  // namespace perdure::tools

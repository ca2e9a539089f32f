#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/dataset.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::unique_ptr<Dataset> open(const fs::path& path) { return Dataset::open({.path = path}); }
std::string errorOfEuroc(const fs::path& path) {
  return startupErrorOf([&] { open(path); });
}

TEST(Euroc, CalibrationIsReadFromTheSensorFiles) {
  const auto dataset = open(tinyEuroc("calibration"));
  EXPECT_EQ(dataset->kind(), DatasetKind::kEuroc);
  const auto& calibration = dataset->calibration();
  ASSERT_EQ(calibration.cameras.size(), 1U);
  const auto& camera = calibration.cameras[0];
  EXPECT_EQ(camera.name, "cam0");
  EXPECT_EQ(camera.width, 32U);
  EXPECT_EQ(camera.fy, 21.0);
  EXPECT_EQ(camera.distortion, DistortionModel::kRadialTangential);
  EXPECT_EQ(camera.distortion_coefficients.size(), 4U);
  EXPECT_EQ(camera.rate_hz, 20.0);
  // T_BS is the camera in the body frame: the camera's z axis points along the body's x axis.
  EXPECT_TRUE((camera.T_BC.q * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX(), 1e-9));
  EXPECT_TRUE(camera.T_BC.p.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3)));
  ASSERT_TRUE(calibration.imu);
  EXPECT_EQ(calibration.imu->gyro_noise, 1.7e-4);
  EXPECT_EQ(calibration.imu->accel_bias_walk, 3e-3);
  EXPECT_FALSE(calibration.has_speed);
}

TEST(Euroc, AnImuThatIsNotTheBodyMovesCamerasAndTruthIntoItself) {
  const auto root = tinyEuroc("imu_not_body");
  const auto file = root / "mav0/imu0/sensor.yaml";
  std::string yaml = readText(file);
  yaml.replace(yaml.find("1.0, 0.0, 0.0, 0.0"), 18, "1.0, 0.0, 0.0, 0.5");
  writeText(file, yaml);
  const auto dataset = open(root);
  EXPECT_TRUE(dataset->calibration().cameras[0].T_BC.p.isApprox(Eigen::Vector3d(-0.4, 0.2, 0.3)));
  EXPECT_TRUE(dataset->truth()->poses()[0].T_WB.p.isApprox(Eigen::Vector3d(1.5, 2, 3)));
}

TEST(Euroc, SamplesAndFramesComeByTimeWithTheSampleFirst) {
  const auto dataset = open(tinyEuroc("order"));
  EXPECT_EQ(dataset->frameCount(), 5U);
  TimePoint last;
  std::size_t samples = 0, frames = 0;
  while (auto message = dataset->next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      EXPECT_GE(imu->time, last);
      EXPECT_EQ(imu->sequence, samples++);
      last = imu->time;
    } else {
      const auto& frame = std::get<Frame>(*message);
      EXPECT_EQ(last, frame.stamp.time) << "the sample of the same time has come before";
      EXPECT_EQ(frame.stamp.sequence, frames++);
      EXPECT_EQ(frame.encoding, ImageEncoding::kMono8);
      ASSERT_TRUE(frame.data);
      EXPECT_EQ(frame.data->size(), 32U * 24U);
    }
  }
  EXPECT_EQ(samples, 61U);
  EXPECT_EQ(frames, 5U);
  EXPECT_TRUE(dataset->reasons().all().empty());
}

TEST(Euroc, ASimulatedVehiclesSpeedComesWithItsSigma) {
  const auto root = tinyEuroc("speed");
  writeText(root / "mav0/speed0/sensor.yaml", "sensor_type: speed\nrate_hz: 50\nsigma: 0.03\n");
  writeText(root / "mav0/speed0/data.csv",
            "#timestamp [ns],speed [m s^-1]\n1000000000,8.5\n1020000000,8.6\n1010000000,1\nx,2\n");
  const auto dataset = open(root);
  EXPECT_TRUE(dataset->calibration().has_speed);
  std::vector<SpeedSample> speed;
  while (auto message = dataset->next()) {
    if (auto* sample = std::get_if<SpeedSample>(&*message)) speed.push_back(*sample);
  }
  ASSERT_EQ(speed.size(), 3U);
  EXPECT_EQ(speed[2].speed, 8.6);
  EXPECT_EQ(speed[2].sigma, 0.03);
  EXPECT_EQ(toNanoseconds(speed[2].time), 1'020'000'000);
  EXPECT_EQ(dataset->reasons().of("speed_malformed"), 1U);
  EXPECT_EQ(dataset->reasons().of("speed_unsorted"), 1U);
  fs::remove(root / "mav0/speed0/sensor.yaml");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("speed0/sensor.yaml"));
}

TEST(Euroc, ImagesMayBeJpegByTheNamesInTheTable) {
  const auto root = tinyEuroc("jpeg");
  const auto table = root / "mav0/cam0/data.csv";
  writeText(table, "#timestamp [ns],filename\n1000000000,1000000000.jpg\n");
  writeImage(root / "mav0/cam0/data/1000000000.jpg", 32, 24, 3);
  const auto dataset = open(root);
  std::optional<Frame> frame;
  while (auto message = dataset->next()) {
    if (auto* one = std::get_if<Frame>(&*message)) frame = *one;
  }
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->encoding, ImageEncoding::kBgr8);
}

TEST(Euroc, WhoWantsNoPixelsNeedsNoImages) {
  const auto root = tinyEuroc("no_images");
  fs::remove_all(root / "mav0/cam0/data");
  const auto dataset = Dataset::open({.path = root, .decode = false});
  std::size_t frames = 0;
  while (auto message = dataset->next()) frames += std::holds_alternative<Frame>(*message);
  EXPECT_EQ(frames, 5U);
}

TEST(Euroc, ASecondCameraSharesIndexAndTimeWithTheFirst) {
  const auto root = tinyEuroc("stereo", true);
  // cam1 is 2 ms late, and its third frame has no partner.
  writeText(root / "mav0/cam1/data.csv",
            "1002000000,1000000000.png\n1052000000,1050000000.png\n1075000000,1100000000.png\n");
  const auto dataset = open(root);
  std::vector<Frame> frames;
  while (auto message = dataset->next()) {
    if (auto* frame = std::get_if<Frame>(&*message)) frames.push_back(*frame);
  }
  ASSERT_EQ(frames.size(), 7U);
  EXPECT_EQ(frames[0].camera, "cam0");
  EXPECT_EQ(frames[1].camera, "cam1");
  EXPECT_EQ(frames[1].stamp.sequence, 0U);
  EXPECT_EQ(frames[1].stamp.time, frames[0].stamp.time);
  EXPECT_EQ(dataset->reasons().of("stereo_unmatched"), 1U);
}

TEST(Euroc, TruthIsInterpolated) {
  const auto dataset = open(tinyEuroc("truth"));
  ASSERT_TRUE(dataset->truth());
  const auto pose = dataset->truth()->at(0, fromNanoseconds(1'040'000'000));
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->p.x(), 1.5, 1e-9);
}

TEST(Euroc, MissingPartsAreNamed) {
  auto root = tinyEuroc("missing");
  fs::remove(root / "mav0/imu0/sensor.yaml");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("imu0/sensor.yaml"));
  root = tinyEuroc("missing");
  fs::remove(root / "mav0/cam0/sensor.yaml");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("cam0/sensor.yaml"));
  root = tinyEuroc("missing");
  fs::remove(root / "mav0/imu0/data.csv");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("imu0/data.csv"));
  root = tinyEuroc("missing");
  writeText(root / "mav0/imu0/data.csv", "#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("imu0/data.csv has no inertial sample"));
  root = tinyEuroc("missing");
  fs::remove_all(root / "mav0/cam0/data");
  EXPECT_THAT(errorOfEuroc(root), HasSubstr("unpack the images"));
}

TEST(Euroc, CalibrationThatMakesNoSenseIsRefusedByKey) {
  const auto root = tinyEuroc("senseless");
  const auto file = root / "mav0/cam0/sensor.yaml";
  const std::string good = readText(file);
  const auto errorWith = [&](const std::string& from, const std::string& to) {
    std::string yaml = good;
    yaml.replace(yaml.find(from), from.size(), to);
    writeText(file, yaml);
    return errorOfEuroc(root);
  };
  EXPECT_THAT(errorWith("[20.0, 21.0, 16.0, 12.0]", "[20.0, -21.0, 16.0, 12.0]"),
              HasSubstr("intrinsics have a focal length"));
  EXPECT_THAT(errorWith("[32, 24]", "[32]"), HasSubstr("resolution is missing or has not 2"));
  EXPECT_THAT(errorWith("radial-tangential", "fov"), HasSubstr("distortion_model is `fov`"));
  EXPECT_THAT(errorWith("-1.0, 0.0, 0.0, 0.2", "-2.0, 0.0, 0.0, 0.2"), HasSubstr("T_BS is not"));
  EXPECT_THAT(errorWith("-1.0, 0.0, 0.0, 0.2", "1.0, 0.0, 0.0, 0.2"), HasSubstr("T_BS is not"));
  EXPECT_THAT(errorWith("T_BS:", "T_BS: 3\nother:"), HasSubstr("T_BS holds no `data`"));
  EXPECT_THAT(errorWith("rate_hz: 20", "rate_hz: x"), HasSubstr("rate_hz is missing or no number"));
}

TEST(Euroc, ALineThatNamesNoImageIsAMissingImage) {
  const auto root = tinyEuroc("unnamed");
  const auto frames = root / "mav0/cam0/data.csv";
  writeText(frames, readText(frames) + "1250000000,\n");
  const auto dataset = open(root);
  while (dataset->next()) {
  }
  EXPECT_EQ(dataset->reasons().of("image_missing"), 1U);
}

TEST(Euroc, BrokenLinesAreCountedAndLeftOut) {
  const auto root = tinyEuroc("broken_lines");
  const auto imu = root / "mav0/imu0/data.csv";
  writeText(imu, readText(imu) + "1250000000,0,0,0,0,0,0\n1260000000,nan,0,0,0,0,0\n12600");
  const auto frames = root / "mav0/cam0/data.csv";
  writeText(frames, readText(frames) + "no stamp,x.png\n");
  const auto dataset = open(root);
  EXPECT_EQ(dataset->reasons().of("imu_not_increasing"), 1U);
  EXPECT_EQ(dataset->reasons().of("imu_malformed"), 2U);
  EXPECT_EQ(dataset->reasons().of("frame_malformed"), 1U);
  EXPECT_EQ(dataset->frameCount(), 6U) << "a line that cannot be read keeps its number";
}

}  // namespace
}  // namespace perdure::replay

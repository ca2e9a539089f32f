#include "tests/tools/data_check/turning_drive.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "common/math/so3.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/support/camera.h"

namespace perdure::tests {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 110.0;

/// Each axis has its own frequency, so that every axis is observable.
Eigen::Vector3d rateAt(const TurningDrive& drive, double t) {
  return drive.turning *
         Eigen::Vector3d(std::sin(5.1 * t), std::cos(4.3 * t), std::sin(3.2 * t + 1.0));
}

constexpr int kWaves = 24;

/// Waves of several lengths and directions.
const std::array<Eigen::Vector3d, kWaves>& waves() {
  static const auto all = [] {
    std::array<Eigen::Vector3d, kWaves> made;
    for (int i = 1; i <= kWaves; ++i) {
      const Eigen::Vector3d wave(std::sin(1.7 * i), std::cos(2.3 * i), std::sin(0.9 * i + 0.4));
      made[static_cast<std::size_t>(i - 1)] = (6.0 + 1.3 * i) * wave;
    }
    return made;
  }();
  return all;
}

/// Grey value of a direction.
double textureAt(const Eigen::Vector3d& ray) {
  double sum = 0.0, phase = 0.0;
  for (const Eigen::Vector3d& wave : waves()) sum += std::sin(wave.dot(ray) + (phase += 1.1));
  return 128.0 + 22.0 * sum;
}

cv::Mat rendered(const Eigen::Quaterniond& q_WB) {
  const Eigen::Quaterniond q_WC = q_WB * trueCameraPlace().q;
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector3d ray((u - 0.5 * kWidth) / kFocal, (v - 0.5 * kHeight) / kFocal, 1.0);
      image.at<uchar>(v, u) = cv::saturate_cast<uchar>(textureAt(q_WC * ray.normalized()));
    }
  }
  return image;
}

/// Most drives have the same rotations, so that each view is rendered once.
const cv::Mat& imageOf(const Eigen::Quaterniond& q_WB) {
  static std::map<std::array<double, 4>, cv::Mat> known;
  cv::Mat& image = known[{q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()}];
  if (image.empty()) image = rendered(q_WB);
  return image;
}

std::string numbers(const Eigen::Matrix4d& m) {
  std::string text;
  for (int i = 0; i < 16; ++i) text += fmt::format("{}{}", i == 0 ? "" : ", ", m(i / 4, i % 4));
  return text;
}

void writeCalibration(const fs::path& mav0, const TurningDrive& drive) {
  replay::writeText(
      mav0 / "cam0/sensor.yaml",
      fmt::format("T_BS:\n  data: [{}]\nrate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\n"
                  "intrinsics: [{}, {}, {}, {}]\ndistortion_model: none\n",
                  numbers(drive.written_T_BC.matrix()), drive.images_hz, kWidth, kHeight, kFocal,
                  kFocal, 0.5 * kWidth, 0.5 * kHeight));
  replay::writeText(mav0 / "imu0/sensor.yaml",
                    fmt::format("rate_hz: {}\ngyroscope_noise_density: 0.0002\n"
                                "gyroscope_random_walk: 2e-05\naccelerometer_noise_density: 0.002\n"
                                "accelerometer_random_walk: 0.003\n",
                                drive.imu_hz));
}

}  // namespace

RigidTransform trueCameraPlace() { return RigidTransform(lookingAhead(), {0.1, 0.0, 0.05}); }

TurningDrive::TurningDrive() : written_T_BC(trueCameraPlace()) {}

fs::path makeTurningDrive(const std::string& name, const TurningDrive& drive) {
  const fs::path root = replay::freshFolder(name), mav0 = root / "mav0";
  fs::create_directories(mav0 / "cam0/data");
  writeCalibration(mav0, drive);
  std::string list = "#timestamp [ns],filename\n", samples = "#timestamp [ns],w,w,w,a,a,a\n";
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  const auto count = static_cast<int>(drive.seconds * drive.imu_hz);
  const int each = static_cast<int>(std::lround(drive.imu_hz / drive.images_hz));
  for (int i = 0; i <= count; ++i) {
    const double t = i / drive.imu_hz;
    const std::int64_t ns = drive.first_ns + static_cast<std::int64_t>(std::llround(1e9 * t));
    ImuSample sample;
    sample.gyro = rateAt(drive, t) + drive.gyro_bias;
    sample.accel = q_WB.conjugate() * Eigen::Vector3d(0, 0, 9.81);
    drive.change(sample);
    samples += fmt::format("{},{},{},{},{},{},{}\n", ns, sample.gyro.x(), sample.gyro.y(),
                           sample.gyro.z(), sample.accel.x(), sample.accel.y(), sample.accel.z());
    if (i % each == 0) {
      const std::string stamp = std::to_string(ns + drive.images_late.count());
      list += stamp + "," + stamp + ".png\n";
      cv::imwrite((mav0 / "cam0/data" / (stamp + ".png")).string(), imageOf(q_WB));
    }
    q_WB = q_WB * expQuaternion(rateAt(drive, t + 0.5 / drive.imu_hz) / drive.imu_hz);
  }
  replay::writeText(mav0 / "cam0/data.csv", list);
  replay::writeText(mav0 / "imu0/data.csv", samples);
  return root;
}

}  // namespace perdure::tests

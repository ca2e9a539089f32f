#include "tests/common/replay/tiny_datasets.h"

#include <unistd.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

std::string digits(std::size_t number, int width) {
  char text[32];
  std::snprintf(text, sizeof text, "%0*zu", width, number);
  return text;
}

constexpr char kCameraYaml[] = R"(%YAML:1.0
# General sensor definitions.
sensor_type: camera
comment: a tiny camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, 1.0, 0.1,
         -1.0, 0.0, 0.0, 0.2,
         0.0, -1.0, 0.0, 0.3,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [32, 24]
camera_model: pinhole
intrinsics: [20.0, 21.0, 16.0, 12.0] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]
)";

constexpr char kImuYaml[] = R"(%YAML:1.0
sensor_type: imu
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 200
gyroscope_noise_density: 1.7e-04
gyroscope_random_walk: 1.9e-05
accelerometer_noise_density: 2.0e-3
accelerometer_random_walk: 3.0e-3
)";

constexpr char kTrackingCalibration[] =
    "P0: 700 0 24 0 0 700 8 0 0 0 1 0\n"
    "P1: 700 0 24 -370 0 700 8 0 0 0 1 0\n"
    "P2: 700 0 24 42 0 700 8 0.7 0 0 1 0\n"
    "P3: 700 0 24 -336 0 700 8 0.7 0 0 1 0\n"
    "R0_rect: 1 0 0 0 1 0 0 0 1\n"
    "Tr_velo_to_cam: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n"
    "Tr_imu_to_velo: 1 0 0 -0.8 0 1 0 0.3 0 0 1 -0.8\n";

std::string oxtsRecord(double speed) {
  std::string text = "49.01 8.42 112.8 0.02 0.001 -1.22 0 0 " + std::to_string(speed) + " 0 0";
  text += " 0.1 0.2 9.8 0.9 0.9 0.9 0.01 0.02 0.03 0.7 0.7 0.7 0.5 0.07 4 10 4 4 0";
  return text;
}

}  // namespace

fs::path freshFolder(const std::string& name) {
  const fs::path folder =
      fs::temp_directory_path() / ("perdure_replay_" + std::to_string(getpid())) / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

void writeText(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

std::string readText(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void writeImage(const fs::path& file, int width, int height, int channels) {
  fs::create_directories(file.parent_path());
  cv::Mat image(height, width, channels == 3 ? CV_8UC3 : CV_8UC1);
  for (int r = 0; r < height; ++r) {
    for (int c = 0; c < width * channels; ++c) image.ptr(r)[c] = static_cast<uchar>(7 * r + 3 * c);
  }
  cv::imwrite(file.string(), image);
}

void writeGrey(const fs::path& file, int width, int height, int value) {
  cv::imwrite(file.string(), cv::Mat(height, width, CV_8UC1, cv::Scalar(value)));
}

void writeDeepImage(const fs::path& file, int width, int height, int bits) {
  cv::Mat image(height, width, CV_16UC1);
  const int most = (1 << bits) - 1, last = width * height - 1;
  for (int i = 0; i <= last; ++i) {
    image.at<std::uint16_t>(i / width, i % width) = static_cast<std::uint16_t>(most * i / last);
  }
  cv::imwrite(file.string(), image);
}

void truncate(const fs::path& file, double share) {
  fs::resize_file(file,
                  static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(file))));
}

fs::path tinyEuroc(const std::string& name, bool stereo) {
  const fs::path root = freshFolder(name), mav0 = root / "mav0";
  for (const std::string camera : {"cam0", "cam1"}) {
    if (camera == "cam1" && !stereo) continue;
    std::string csv = "#timestamp [ns],filename\r\n";
    for (std::size_t i = 0; i < 5; ++i) {
      const std::string stamp = std::to_string(1'000'000'000 + 50'000'000 * i);
      csv += stamp + "," + stamp + ".png\r\n";
      writeImage(mav0 / camera / "data" / (stamp + ".png"), 32, 24, 1);
    }
    writeText(mav0 / camera / "data.csv", csv);
    writeText(mav0 / camera / "sensor.yaml", kCameraYaml);
  }
  std::string imu = "#timestamp [ns],w x,w y,w z,a x,a y,a z\n";
  for (std::size_t i = 0; i < 61; ++i) {
    imu += std::to_string(950'000'000 + 5'000'000 * i) + ",0.1,0.2,0.3,9.7,0.5,-0.5\n";
  }
  writeText(mav0 / "imu0" / "data.csv", imu);
  writeText(mav0 / "imu0" / "sensor.yaml", kImuYaml);
  writeText(mav0 / "state_groundtruth_estimate0" / "data.csv",
            "#timestamp, p, q w x y z, v, b_w, b_a\n"
            "990000000,1,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n"
            "1090000000,2,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n");
  return root;
}

fs::path tinyKittiRaw(const std::string& name) {
  const fs::path day = freshFolder(name), drive = day / "2011_09_26_drive_9999_sync";
  std::string images, oxts;
  for (std::size_t i = 0; i < 4; ++i) {
    images += "2011-09-26 13:04:32." + digits(100'000'000 + 103'000'000 * i, 9) + "\n";
    oxts += "2011-09-26 13:04:32." + digits(107'000'000 + 103'000'000 * i, 9) + "\n";
    writeImage(drive / "image_02" / "data" / (digits(i, 10) + ".jpg"), 48, 16, 3);
    writeImage(drive / "image_03" / "data" / (digits(i, 10) + ".png"), 48, 16, 3);
    writeText(drive / "oxts" / "data" / (digits(i, 10) + ".txt"),
              oxtsRecord(3.0 + static_cast<double>(i)) + "\n");
  }
  writeText(drive / "image_02" / "timestamps.txt", images);
  writeText(drive / "image_03" / "timestamps.txt", images);
  writeText(drive / "oxts" / "timestamps.txt", oxts);
  writeText(day / "calib_cam_to_cam.txt",
            "calib_time: 09-Jan-2012 13:57:47\n"
            "R_rect_00: 1 0 0 0 1 0 0 0 1\n"
            "S_rect_02: 48 16\n"
            "P_rect_02: 700 0 24 42 0 700 8 0.7 0 0 1 0\n"
            "P_rect_03: 700 0 24 -336 0 700 8 0.7 0 0 1 0\n");
  writeText(day / "calib_velo_to_cam.txt", "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.1 -0.3\n");
  writeText(day / "calib_imu_to_velo.txt", "R: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n");
  return drive;
}

fs::path tinyKittiTracking(const std::string& name) {
  const fs::path root = freshFolder(name);
  for (const std::string sequence : {"0000", "0001"}) {
    writeText(root / "calib" / (sequence + ".txt"), kTrackingCalibration);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    writeImage(root / "image_02" / "0000" / (digits(i, 6) + ".png"), 48, 16, 3);
  }
  writeText(root / "label_02" / "0001.txt",
            "0 3 Car 0 0 -1.5 10 20 60 70 1.5 1.6 4.0 1.0 1.65 10.0 -1.57\n"
            "4 -1 DontCare -1 -1 -10 1 2 3 4 -1000 -1000 -1000 -10 -1 -1 -1\n");
  return root;
}

namespace {

/// Pose of the first camera of tinySevenScenes in a world with the floor at z = 0 and a wall at x =
/// 3.
Eigen::Matrix3d tinySceneCamera() {
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  constexpr double kDegree = 3.14159265358979 / 180.0;
  return Eigen::AngleAxisd(25.0 * kDegree, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(10.0 * kDegree, Eigen::Vector3d::UnitX()) * R_BC;
}

cv::Mat tinySceneDepth(double x) {
  const Eigen::Matrix3d R = tinySceneCamera();
  cv::Mat depth(480, 640, CV_16UC1, cv::Scalar(0));
  for (int r = 0; r < depth.rows; ++r) {
    for (int c = 0; c < depth.cols; ++c) {
      const Eigen::Vector3d ray = R * Eigen::Vector3d((c - 320) / 585.0, (r - 240) / 585.0, 1.0);
      double z = (3.0 - x) / std::max(1e-6, ray.x());
      if (ray.z() < 0.0) z = std::min(z, -1.4 / ray.z());
      if (z < 8.0) depth.at<std::uint16_t>(r, c) = static_cast<std::uint16_t>(1000.0 * z + 0.5);
    }
  }
  return depth;
}

}  // namespace

Eigen::Vector3d tinySevenScenesUp() {
  return tinySceneCamera().transpose() * Eigen::Vector3d::UnitZ();
}

fs::path tinySevenScenes(const std::string& name, bool folders) {
  const fs::path root = freshFolder(name);
  for (int i = 0; i < 3; ++i) {
    const std::string number = "00000" + std::to_string(i);
    const auto file = [&](const char* folder, const char* ending) {
      return folders ? root / folder / (number + ending)
                     : root / ("frame-" + number + "." + folder + ending);
    };
    const Eigen::Vector3d p = tinySceneCamera().transpose() * Eigen::Vector3d(0.1 * i, 0, 0);
    std::ostringstream pose;
    pose << "1 0 0 " << p.x() << "\n0 1 0 " << p.y() << "\n0 0 1 " << p.z() << "\n0 0 0 1\n";
    writeImage(file("color", folders ? ".jpg" : ".png"), 640, 480, 3);
    writeText(file("pose", ".txt"), pose.str());
    fs::create_directories(file("depth", ".png").parent_path());
    cv::imwrite(file("depth", ".png").string(), tinySceneDepth(0.1 * i));
  }
  return root;
}

std::string startupErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const StartupError& error) {
    return error.what();
  }
  return {};
}

ExitCode startupCodeOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const StartupError& error) {
    return error.code();
  }
  return ExitCode::kOk;
}

}  // namespace perdure::replay

// A small EuRoC drive written at run time: numbered frames of 16×12 pixels and IMU samples.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>

namespace perdure::capture::testing {

struct TinyDrive {
  int frames = 20;
  std::int64_t frame_period_ns = 50'000'000, imu_period_ns = 10'000'000;
  std::int64_t start_ns = 1'000'000'000'000;
  std::int64_t imu_before_ns = 20'000'000, imu_after_ns = 100'000'000;
  bool stereo = false;
  int truncated = -1;                                ///< index of a frame with a truncated file
  int imu_gap_after = -1, imu_gap_ns = 500'000'000;  ///< index of a frame

  std::string write(const std::filesystem::path& folder) const {
    writeCamera(folder / "mav0/cam0");
    if (stereo) writeCamera(folder / "mav0/cam1");
    writeImu(folder / "mav0/imu0");
    return folder.string();
  }

 private:
  void writeCamera(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder / "data");
    std::ofstream(folder / "sensor.yaml")
        << "rate_hz: 20\nresolution: [16, 12]\nintrinsics: [10.0, 10.0, 8.0, 6.0]\n"
           "T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
    std::ofstream csv(folder / "data.csv");
    csv << "#timestamp [ns],filename\n";
    for (int i = 0; i < frames; ++i) {
      const std::string name = std::to_string(i) + ".png";
      csv << start_ns + i * frame_period_ns << "," << name << "\n";
      const auto file = folder / "data" / name;
      cv::imwrite(file.string(), cv::Mat(12, 16, CV_8U, cv::Scalar(i)));
      if (i == truncated) std::filesystem::resize_file(file, 40);
    }
  }

  void writeImu(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "sensor.yaml")
        << "rate_hz: 100\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-5\n"
           "accelerometer_noise_density: 1e-3\naccelerometer_random_walk: 1e-3\n";
    std::ofstream csv(folder / "data.csv");
    csv << "#timestamp [ns],w,w,w,a,a,a\n";
    const std::int64_t end = start_ns + (frames - 1) * frame_period_ns + imu_after_ns;
    const std::int64_t gap = start_ns + imu_gap_after * frame_period_ns;
    for (std::int64_t t = start_ns - imu_before_ns; t <= end; t += imu_period_ns) {
      if (imu_gap_after >= 0 && t > gap && t < gap + imu_gap_ns) continue;
      csv << t << ",0,0,0,0,0,9.81\n";
    }
  }
};

}  // namespace perdure::capture::testing

// Configuration of the service capture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/config/fields.h"

namespace perdure::capture {

struct DatasetConfig {
  std::string path;
  std::string sequence;             ///< only for KITTI tracking
  std::vector<std::string> topics;  ///< topics of a ROS recording, as "cam0=/image_raw"
  std::string cameras = "stereo";
  double lead_s = 5.0, trail_s = 0.5;
};

struct ImageConfig {
  std::string cam0 = "as_is", cam1 = "mono8";
  std::string compress = "none";
  std::int64_t quality = 90;
};

struct PaceConfig {
  std::string mode = "clock";
  double rate = 1.0;
  std::int64_t window = 1;
  double timeout_s = 2.0;
};

struct StartConfig {
  std::vector<std::string> readers;
  double timeout_s = 60.0;
};

struct RunConfig {
  std::string state;
  std::string on_end = "stay";
};

struct CameraConfig {
  /// libcamera's ids, or parts of the ids, of cam0 and cam1. An empty `id` selects the first
  /// camera; with an empty `second` there is no cam1.
  std::string id, second;
  std::string format = "auto";  ///< libcamera's name, for example "YUYV"; auto: the best available
  double rate_hz = 20.0;
  double exposure_ms = 0.0, gain = 0.0;  ///< 0: automatic
  std::string flip = "none";             ///< "none", "horizontal", "vertical" or "both"
  std::string focus = "as_is";           ///< as_is, auto, or manual (at lens_dioptres)
  double lens_dioptres = 0.0;            ///< 1/m; 0: infinity
  std::vector<double> crop;              ///< x, y, width, height in sensor pixels; empty: all
};

struct ImuConfig {
  std::string uri = "local:";
  std::string gyro, accel, trigger;
  double rate_hz = 200.0;
  std::vector<double> mount;  ///< empty, or 9 values: rows of R in v_B = R v_device
};

struct SpeedConfig {
  std::string source = "none";
  std::string can_interface = "can0", can_reverse;
  std::vector<std::string> can_signals;
  std::string address = "127.0.0.1:5600";
  double sigma = 0.05, latency_s = 0.0;
};

struct GnssConfig {
  std::string source = "none", address = "127.0.0.1:2947";
  double most_sigma = 5.0, latency_s = 0.0;
  std::vector<double> antenna;  ///< empty, or 3 values: position in the body, m
};

struct Config {
  std::string source = "dataset";
  std::string rig;
  CameraConfig camera;
  ImuConfig imu;
  SpeedConfig speed;
  GnssConfig gnss;
  DatasetConfig dataset;
  ImageConfig image;
  PaceConfig pace;
  StartConfig start;
  RunConfig run;
};

void describe(Config& config, config::Fields& fields);

/// Throws StartupError if a setting that the source needs is missing.
void requireSource(const Config& config);

}  // namespace perdure::capture

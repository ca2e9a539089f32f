// Configuration of the bridge to ROS 2.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/config/fields.h"

namespace perdure::ros2 {

/// "same": stamps are on the vehicle's common clock. "own": they are on another clock, and are
/// converted by their times of arrival.
inline constexpr char kSameClock[] = "same", kOwnClock[] = "own";

struct CameraInput {
  std::string name;  ///< name in Perdure, for example "cam0"
  std::string image, info = {}, type = "auto", clock = kSameClock;
  std::int64_t bits = 0;
  bool given() const { return !image.empty(); }
  bool compressed() const;
  std::string infoTopic() const;  ///< returns `info` if set, else the usual topic beside the image
};

struct StreamInput {
  std::string topic, clock = kSameClock;
  bool given() const { return !topic.empty(); }
};

struct DetectionsInput {
  std::string topic, camera = "cam0";
  std::vector<std::string> classes;
  double other_share = 0.3, box_sigma = 0.0;
  std::string boxes = "outline";
  std::int64_t strength = 10;
  bool given() const { return !topic.empty(); }
};

struct OdometryInput : StreamInput {
  double sigma_position = 0.05, sigma_rotation = 0.01, jump_m = 3.0;
};

struct Config {
  std::int64_t domain = -1;
  std::string interface;
  std::vector<std::string> peers;

  bool out = true;
  std::string prefix = "/perdure";
  std::vector<std::string> shown_cameras = {"cam0"};
  bool tf = true, clock = false;
  std::string tracked_objects;
  std::int64_t image_quality = 80;

  CameraInput cam0{"cam0", {}}, cam1{"cam1", {}};
  StreamInput imu;
  OdometryInput odometry;
  DetectionsInput detections;
  std::string rig, body;
  double apart_s = 5.0;
  bool reliable = false;

  std::vector<CameraInput> cameras() const;  ///< returns the configured cameras, cam0 first
  bool anyInput() const;
};

void describe(Config& config, config::Fields& fields);
/// Checks conditions between fields. Throws StartupError (78) if one is violated.
void verify(const Config& config);

}  // namespace perdure::ros2

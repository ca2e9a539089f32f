// The output of capture: images, inertial samples, speed, calibration. SI units, sensor clock.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/base/shared_bytes.h"
#include "common/base/time.h"
#include "common/math/rigid_transform.h"
#include "common/types/description.h"

namespace perdure {

/// JPEG is used in transport only; readers decode frames first (common/vision/jpeg.h).
enum class ImageEncoding : std::uint8_t { kMono8 = 0, kBgr8 = 1, kJpegMono8 = 2, kJpegBgr8 = 3 };

/// Number of channels of the decoded image; equals the bytes per pixel of a raw image.
constexpr std::uint32_t channelsOf(ImageEncoding e) {
  return e == ImageEncoding::kBgr8 || e == ImageEncoding::kJpegBgr8 ? 3 : 1;
}
constexpr bool isCompressed(ImageEncoding e) {
  return e == ImageEncoding::kJpegMono8 || e == ImageEncoding::kJpegBgr8;
}

/// One image of one camera. Rows are packed: data has width·height·channels bytes, or is a JPEG.
struct Frame {
  FrameStamp stamp;
  std::string camera;  ///< "cam0", "cam1"
  std::uint32_t width = 0, height = 0;
  ImageEncoding encoding = ImageEncoding::kMono8;
  SharedBytes data;  ///< a received frame refers to the memory of the received message
};

struct ImuSample {
  InstanceId source = 0;
  std::uint64_t sequence = 0;
  TimePoint time;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< w_WB_B plus bias, rad/s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force in B plus bias, m/s²
};

/// Speed of the body's origin along its x axis, from the wheels of a vehicle or an odometer.
struct SpeedSample {
  InstanceId source = 0;
  std::uint64_t sequence = 0;
  TimePoint time;
  double speed = 0.0;  ///< m/s, forwards positive
  double sigma = 0.1;  ///< m/s, > 0
};

enum class DistortionModel : std::uint8_t {
  kNone = 0,
  kRadialTangential = 1,  ///< k1 k2 p1 p2 (OpenCV, EuRoC "radial-tangential")
  kEquidistant = 2,       ///< k1 k2 k3 k4 (Kannala-Brandt, OpenCV fisheye)
  kRational = 3,  ///< k1 k2 p1 p2 k3 k4 k5 k6 (OpenCV); k4 … k6 are 0 for a lens with k3 only
};

constexpr std::size_t coefficientsOf(DistortionModel model) {
  return model == DistortionModel::kNone ? 0 : model == DistortionModel::kRational ? 8 : 4;
}

/// Standard deviations of a calibration; 0: not known.
struct CameraDeviations {
  double focal = 0.0;       ///< of both focal lengths, relative
  double centre_px = 0.0;   ///< of the principal point
  double distortion = 0.0;  ///< of the first two coefficients
  double rotation = 0.0;    ///< of T_BC, rad about each axis
  double position_m = 0.0;  ///< of T_BC, along each axis
  double time_offset_s = 0.0;

  bool operator==(const CameraDeviations&) const = default;
};

struct CameraCalibration {
  std::string name;  ///< "cam0"
  std::uint32_t width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  DistortionModel distortion = DistortionModel::kNone;
  std::vector<double> distortion_coefficients;  ///< coefficientsOf() gives their number
  RigidTransform T_BC;                          ///< camera in body
  double time_offset_s = 0.0;                   ///< t_imu = t_image + time_offset_s
  double readout_s = 0.0;                       ///< rolling shutter, first to last row; 0 = global
  double rate_hz = 0.0;                         ///< nominal
  CameraDeviations deviations;
};

struct ImuCalibration {
  double gyro_noise = 0.0;       ///< rad/s/√Hz
  double gyro_bias_walk = 0.0;   ///< rad/s²/√Hz
  double accel_noise = 0.0;      ///< m/s²/√Hz
  double accel_bias_walk = 0.0;  ///< m/s³/√Hz
  double rate_hz = 0.0;          ///< nominal
};

/// The position and heading of the body on Earth at a sensor time.
struct GeoAnchor {
  TimePoint time;
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;  ///< WGS 84
  double yaw = 0;  ///< heading of the body's x axis, radians from east, counter-clockwise
};

struct Calibration {
  InstanceId source = 0;
  std::vector<CameraCalibration> cameras;  ///< the first is the camera of the detections
  std::optional<ImuCalibration> imu;
  bool has_speed = false;
  std::optional<GeoAnchor> anchor;

  const CameraCalibration* camera(const std::string& name) const {
    for (const auto& c : cameras) {
      if (c.name == name) return &c;
    }
    return nullptr;
  }
};

}  // namespace perdure

namespace perdure::wire {

void describe(auto& a, Is<Frame> auto& d, auto& w) {
  a.object("stamp", d.stamp, w.stamp);
  a.name("camera", d.camera, w.camera);
  a.value("width", d.width, w.width);
  a.value("height", d.height, w.height);
  a.choice("encoding", d.encoding, w.encoding, ImageEncoding::kJpegBgr8);
  a.ensure("width", "out_of_range", [&] { return d.width >= 1 && d.width <= kImageSide; });
  a.ensure("height", "out_of_range", [&] { return d.height >= 1 && d.height <= kImageSide; });
  a.pixels("pixels", d, w);
}

void describe(auto& a, Is<ImuSample> auto& d, auto& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.matrix("gyro", d.gyro, w.gyro, kAngularRate);
  a.matrix("accel", d.accel, w.accel, kAcceleration);
}

void describe(auto& a, Is<SpeedSample> auto& d, auto& w) {
  a.value("source", d.source, w.source);
  a.value("sequence", d.sequence, w.seq);
  a.time("time_ns", d.time, w.time_ns);
  a.number("speed", d.speed, w.speed, kSpeed);
  a.number("sigma", d.sigma, w.sigma, kPositive);
}

void describe(auto& a, Is<CameraCalibration> auto& d, auto& w) {
  a.name("name", d.name, w.name);
  a.value("width", d.width, w.width);
  a.value("height", d.height, w.height);
  a.ensure("width", "out_of_range", [&] { return d.width >= 1 && d.width <= kImageSide; });
  a.ensure("height", "out_of_range", [&] { return d.height >= 1 && d.height <= kImageSide; });
  a.number("fx", d.fx, w.fx, kPositive);
  a.number("fy", d.fy, w.fy, kPositive);
  a.number("cx", d.cx, w.cx, kPixel);
  a.number("cy", d.cy, w.cy, kPixel);
  a.choice("distortion", d.distortion, w.distortion, DistortionModel::kRational);
  a.numbers("distortion_coefficients", d.distortion_coefficients, w.coefficients, kMatrixEntry,
            kCoefficients);
  a.ensure("distortion_coefficients", "size_mismatch", [&] {
    const std::size_t needed = coefficientsOf(d.distortion);
    return d.distortion_coefficients.size() == needed || d.distortion_coefficients.empty();
  });
  a.pose("T_BC", d.T_BC, w.T_BC);
  a.number("time_offset_s", d.time_offset_s, w.time_offset_s, kOffset);
  a.number("readout_s", d.readout_s, w.readout_s, kOffset);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
  auto& s = d.deviations;
  a.number("focal_sigma", s.focal, w.focal_sigma, kNotNegative);
  a.number("centre_sigma_px", s.centre_px, w.centre_sigma_px, kNotNegative);
  a.number("distortion_sigma", s.distortion, w.distortion_sigma, kNotNegative);
  a.number("rotation_sigma", s.rotation, w.rotation_sigma, kNotNegative);
  a.number("position_sigma_m", s.position_m, w.position_sigma_m, kNotNegative);
  a.number("time_offset_sigma_s", s.time_offset_s, w.time_offset_sigma_s, kNotNegative);
}

void describe(auto& a, Is<ImuCalibration> auto& d, auto& w) {
  a.number("gyro_noise", d.gyro_noise, w.gyro_noise, kNotNegative);
  a.number("gyro_bias_walk", d.gyro_bias_walk, w.gyro_bias_walk, kNotNegative);
  a.number("accel_noise", d.accel_noise, w.accel_noise, kNotNegative);
  a.number("accel_bias_walk", d.accel_bias_walk, w.accel_bias_walk, kNotNegative);
  a.number("rate_hz", d.rate_hz, w.rate_hz, kNotNegative);
}

void describe(auto& a, Is<GeoAnchor> auto& d, auto& w) {
  a.time("time_ns", d.time, w.time_ns);
  a.number("latitude_deg", d.latitude_deg, w.latitude_deg, kLatitudeDeg);
  a.number("longitude_deg", d.longitude_deg, w.longitude_deg, kLongitudeDeg);
  a.number("height_m", d.height_m, w.height_m, kCoordinate);
  a.number("yaw", d.yaw, w.yaw, kAngle);
}

void describe(auto& a, Is<Calibration> auto& d, auto& w) {
  a.value("source", d.source, w.source);
  a.list("cameras", d.cameras, w.cameras, kCameras);
  a.optional("imu", d.imu, w.has_imu, w.imu);
  a.value("has_speed", d.has_speed, w.has_speed);
  a.optional("anchor", d.anchor, w.has_anchor, w.anchor);
}

}  // namespace perdure::wire

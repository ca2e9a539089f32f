#include "services/gateway/core/world.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/math/so3.h"
#include "services/gateway/core/json_writer.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

constexpr std::size_t kMostPoses = 4000;
constexpr std::chrono::seconds kBack{2};

void putTransform(JsonWriter& json, TimePoint time, const std::string& parent,
                  const std::string& child, const RigidTransform& T) {
  json.begin('{').with("timestamp", time).with("parent_frame_id", parent);
  json.with("child_frame_id", child).with("translation", T.p).with("rotation", T.q).end('}');
}

void putHeader(JsonWriter& json, TimePoint time, const std::string& frame) {
  json.begin('{').with("timestamp", time).with("frame_id", frame);
}

/// Writes little-endian CDR. Alignment to at most four bytes suffices for the members of the image.
class Cdr {
 public:
  explicit Cdr(std::size_t expected) {
    bytes_.reserve(expected);
    bytes_.append("\x00\x01\x00\x00", 4);
  }
  void natural(std::uint32_t value) {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    for (unsigned shift = 0; shift < 32; shift += 8) {
      bytes_ += static_cast<char>((value >> shift) & 0xffU);
    }
  }
  void text(const std::string& value) {
    natural(static_cast<std::uint32_t>(value.size() + 1));
    bytes_ += value;
    bytes_ += '\0';
  }
  void octets(std::span<const std::uint8_t> value) {
    natural(static_cast<std::uint32_t>(value.size()));
    bytes_.append(reinterpret_cast<const char*>(value.data()), value.size());
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace

std::string frameTransforms(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB,
                            const Calibration* calibration, std::optional<double> yaw_from_east) {
  JsonWriter json;
  json.begin('{').key("transforms").begin('[');
  putTransform(json, time, kMapFrame, kOdomFrame, T_MW);
  putTransform(json, time, kOdomFrame, kBodyFrame, T_WB);
  if (yaw_from_east) {
    const RigidTransform T_WE{rotationAboutZ(-*yaw_from_east), Eigen::Vector3d::Zero()};
    putTransform(json, time, kOdomFrame, kEarthFrame, T_WE);
  }
  if (calibration != nullptr) {
    for (const CameraCalibration& camera : calibration->cameras) {
      putTransform(json, time, kBodyFrame, opticalFrame(camera.name), camera.T_BC);
    }
  }
  return json.end(']').end('}').take();
}

std::string poseInFrame(TimePoint time, const RigidTransform& T_WB) {
  JsonWriter json;
  putHeader(json, time, kOdomFrame);
  return json.with("pose", T_WB).end('}').take();
}

std::string landmarksAsPoints(const Landmarks& landmarks) {
  constexpr int kFloat32 = 7;
  constexpr std::size_t kStride = 16;
  static_assert(std::endian::native == std::endian::little, "floats go out as they lie");
  std::vector<std::uint8_t> points(kStride * landmarks.landmarks.size());
  std::uint8_t* to = points.data();
  for (const Landmark& one : landmarks.landmarks) {
    const double sigma = std::sqrt(std::max(0.0, one.covariance.trace() / 3));
    const std::array<float, 4> values{static_cast<float>(one.p_W.x()),
                                      static_cast<float>(one.p_W.y()),
                                      static_cast<float>(one.p_W.z()), static_cast<float>(sigma)};
    std::memcpy(to, values.data(), kStride);
    to += kStride;
  }
  JsonWriter json(512 + 2 * points.size());
  putHeader(json, landmarks.stamp.time, kOdomFrame);
  json.with("pose", RigidTransform{}).with("point_stride", kStride).key("fields").begin('[');
  int offset = 0;
  for (const char* name : {"x", "y", "z", "sigma"}) {
    json.begin('{').with("name", name).with("offset", offset).with("type", kFloat32).end('}');
    offset += 4;
  }
  return json.end(']').key("data").raw('"' + base64(points) + '"').end('}').take();
}

std::string cameraCalibration(const CameraCalibration& camera, TimePoint time) {
  const std::array<double, 9> K{camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  const std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<double, 12> P{camera.fx, 0, camera.cx, 0, 0, camera.fy,
                                 camera.cy, 0, 0,         0, 1, 0};
  std::vector<double> D = camera.distortion_coefficients;
  const bool fisheye = camera.distortion == DistortionModel::kEquidistant;
  if (!fisheye) D.resize(5, 0.0);  // plumb_bob has five coefficients
  JsonWriter json;
  putHeader(json, time, opticalFrame(camera.name));
  json.with("width", camera.width).with("height", camera.height);
  json.with("distortion_model", fisheye ? "kannala_brandt" : "plumb_bob").with("D", D, 9);
  return json.with("K", K, 6).with("R", R).with("P", P, 6).end('}').take();
}

std::string compressedImage(const FrameStamp& stamp, const std::string& camera,
                            std::span<const std::uint8_t> jpeg) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = std::max<std::int64_t>(0, toNanoseconds(stamp.time));
  Cdr cdr(jpeg.size() + 128);
  cdr.natural(static_cast<std::uint32_t>(ns / kSecond));
  cdr.natural(static_cast<std::uint32_t>(ns % kSecond));
  cdr.text(opticalFrame(camera));
  cdr.octets(jpeg);
  cdr.text("jpeg");
  return cdr.take();
}

void Trajectory::add(TimePoint time, const WorldId& world, const RigidTransform& T_WB) {
  const bool again = time + kBack < time_;  // true: the recording has restarted
  if (world != world_ || again) {
    world_ = world;
    poses_.clear();
    step_m_ = 0.25;
  }
  time_ = time;
  newest_ = T_WB;
  if (!poses_.empty() && (poses_.back().p - T_WB.p).norm() < step_m_) return;
  poses_.push_back(T_WB);
  if (poses_.size() < kMostPoses) return;
  step_m_ *= 2;
  for (std::size_t i = 1; 2 * i < poses_.size(); ++i) poses_[i] = poses_[2 * i];
  poses_.resize(poses_.size() / 2);
}

std::string Trajectory::posesInFrame() const {
  JsonWriter json(256 + 160 * poses_.size());
  putHeader(json, time_, kOdomFrame);
  json.key("poses").begin('[');
  for (const RigidTransform& pose : poses_) put(json, pose);
  if (!poses_.empty()) put(json, newest_);
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway

#include "common/ros/sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "common/camera/lens.h"
#include "common/ros/frames.h"

namespace perdure::ros {
namespace {

Eigen::Vector3d vectorOf(const Vector3& v) { return {v.x, v.y, v.z}; }

/// Names the first non-finite number in `values`: "D[1] is nan". Returns "" if there is none.
std::string notFinite(const char* name, std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return fmt::format("{}[{}] is {}", name, i, values[i]);
  }
  return {};
}

std::string sentenceOf(const TransformStamped& one, double norm) {
  const auto& [p, q] = one.transform;
  const std::string which =
      fmt::format("the transform from `{}` to `{}`", one.header.frame_id, one.child_frame_id);
  const std::string turn = fmt::format("{:g}, {:g}, {:g}, {:g}", q.x, q.y, q.z, q.w);
  if (std::isfinite(p.x + p.y + p.z + norm)) {
    return fmt::format("{} is none: the length of its quaternion (x, y, z, w: {}) is not 1", which,
                       turn);
  }
  return fmt::format("{} is none: translation {:g}, {:g}, {:g}, quaternion (x, y, z, w) {}", which,
                     p.x, p.y, p.z, turn);
}

}  // namespace

TimePoint timeOf(const Time& time) {
  return fromNanoseconds(std::int64_t{time.sec} * 1'000'000'000 + time.nanosec);
}

ImuSample sampleOf(const Imu& imu) {
  ImuSample sample;
  sample.time = timeOf(imu.header.stamp);
  sample.gyro = vectorOf(imu.angular_velocity);
  sample.accel = vectorOf(imu.linear_acceleration);
  return sample;
}

Result<CameraCalibration> cameraOf(const CameraInfo& info, bool rectified) {
  CameraCalibration camera;
  const auto& k = info.k;
  const auto& p = info.p;
  std::string wrong = rectified ? notFinite("P", p) : notFinite("K", k);
  if (wrong.empty() && !rectified) wrong = notFinite("D", info.d);
  if (!wrong.empty()) return fail("not_finite", "in its camera_info " + wrong);
  camera.fx = rectified ? p[0] : k[0], camera.fy = rectified ? p[5] : k[4];
  camera.cx = rectified ? p[2] : k[2], camera.cy = rectified ? p[6] : k[5];
  if (!(camera.fx > 0.0) || !(camera.fy > 0.0)) {
    return fail("uncalibrated", std::string("its camera_info has no focal length in ") +
                                    (rectified ? "P" : "K") + ": the driver has no calibration");
  }
  const bool cut = info.roi.width > 0 && info.roi.height > 0;
  const std::uint32_t bx = std::max(info.binning_x, 1u), by = std::max(info.binning_y, 1u);
  camera.width = (cut ? info.roi.width : info.width) / bx;
  camera.height = (cut ? info.roi.height : info.height) / by;
  camera.cx = (camera.cx - (cut ? info.roi.x_offset : 0)) / bx, camera.fx /= bx;
  camera.cy = (camera.cy - (cut ? info.roi.y_offset : 0)) / by, camera.fy /= by;
  if (rectified) return camera;
  const bool straight = std::ranges::all_of(info.d, [](double d) { return d == 0; });
  if (straight) return camera;
  const auto set = setLens(camera, info.distortion_model, info.d);
  if (!set) {
    return fail("lens", "its camera_info's " + set.error().code + " " + set.error().detail);
  }
  return camera;
}

Imu imuOf(const ImuSample& sample, const ImuCalibration* noise) {
  Imu imu;
  imu.header = headerOf(sample.time, kImuFrame);
  imu.orientation_covariance[0] = -1.0;
  imu.angular_velocity = {sample.gyro.x(), sample.gyro.y(), sample.gyro.z()};
  imu.linear_acceleration = {sample.accel.x(), sample.accel.y(), sample.accel.z()};
  if (noise == nullptr) return imu;
  for (const std::size_t i : {0u, 4u, 8u}) {
    imu.angular_velocity_covariance[i] = noise->gyro_noise * noise->gyro_noise * noise->rate_hz;
    imu.linear_acceleration_covariance[i] =
        noise->accel_noise * noise->accel_noise * noise->rate_hz;
  }
  return imu;
}

CameraInfo infoOf(const CameraCalibration& camera, TimePoint time) {
  CameraInfo info;
  info.header = headerOf(time, opticalFrame(camera.name));
  info.width = camera.width, info.height = camera.height;
  const auto& c = camera.distortion_coefficients;
  info.d = c;
  switch (camera.distortion) {
    case DistortionModel::kNone:
      info.d.assign(5, 0.0);
      [[fallthrough]];
    case DistortionModel::kRadialTangential:
      info.distortion_model = "plumb_bob";
      info.d.resize(5, 0.0);  // k3
      break;
    case DistortionModel::kEquidistant:
      info.distortion_model = "equidistant";
      break;
    case DistortionModel::kRational:
      info.distortion_model = "rational_polynomial";
      break;
  }
  info.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

RigidTransform transformOf(const Transform& transform) {
  const auto& q = transform.rotation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), vectorOf(transform.translation)};
}

std::string frameName(const std::string& frame_id) {
  return frame_id.starts_with('/') ? frame_id.substr(1) : frame_id;
}

void FrameTree::add(const TFMessage& message) {
  for (const TransformStamped& one : message.transforms) {
    const auto& q = one.transform.rotation;
    const RigidTransform T = transformOf(one.transform);
    const double norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!(std::abs(norm - 1.0) < 0.02) || !T.finite()) {
      refused_[frameName(one.child_frame_id)] = sentenceOf(one, norm);
      continue;
    }
    parents_[frameName(one.child_frame_id)] = {frameName(one.header.frame_id), T};
  }
}

/// Returns T_ancestor_frame for the frame itself and all its ancestors.
std::map<std::string, RigidTransform> FrameTree::toRoots(std::string frame) const {
  std::map<std::string, RigidTransform> ways;
  RigidTransform T;
  while (ways.emplace(frame, T).second) {
    const auto edge = parents_.find(frame);
    if (edge == parents_.end()) break;
    T = edge->second.T_parent_child * T;
    frame = edge->second.parent;
  }
  return ways;
}

std::optional<RigidTransform> FrameTree::find(const std::string& to,
                                              const std::string& from) const {
  const auto ups = toRoots(frameName(to)), downs = toRoots(frameName(from));
  for (const auto& [ancestor, T_ancestor_to] : ups) {
    const auto other = downs.find(ancestor);
    if (other != downs.end()) return T_ancestor_to.inverse() * other->second;
  }
  return std::nullopt;
}

}  // namespace perdure::ros

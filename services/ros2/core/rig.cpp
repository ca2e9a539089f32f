#include "services/ros2/core/rig.h"

#include <algorithm>
#include <cmath>

namespace perdure::ros2 {
namespace {

constexpr std::size_t kIntervals = 5;  ///< intervals between images, for the camera's rate

double rateOf(std::vector<double> intervals) {
  std::nth_element(intervals.begin(), intervals.begin() + kIntervals / 2, intervals.end());
  return 1.0 / intervals[kIntervals / 2];
}

bool sameLens(const ros::CameraInfo& a, const ros::CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.k == b.k && a.d == b.d && a.p == b.p &&
         a.distortion_model == b.distortion_model && a.binning_x == b.binning_x &&
         a.binning_y == b.binning_y && a.roi.x_offset == b.roi.x_offset &&
         a.roi.y_offset == b.roi.y_offset && a.roi.width == b.roi.width &&
         a.roi.height == b.roi.height;
}

bool finite(const CameraCalibration& camera) {
  const auto fine = [](double x) { return std::isfinite(x); };
  return fine(camera.fx) && fine(camera.fy) && fine(camera.cx) && fine(camera.cy) &&
         std::ranges::all_of(camera.distortion_coefficients, fine);
}

}  // namespace

Rig::Rig(std::vector<RigCamera> cameras, Calibration given, bool has_imu, bool has_odometry,
         std::string body)
    : given_(std::move(given)),
      has_imu_(has_imu),
      has_odometry_(has_odometry),
      body_(std::move(body)) {
  for (RigCamera& camera : cameras) cameras_.push_back({std::move(camera)});
}

std::string Rig::body() const {
  if (!body_.empty()) return body_;
  if (has_imu_) return imu_frame_;
  if (has_odometry_) return child_frame_;
  return cameras_.empty() ? "" : cameras_.front().frame_id;
}

void Rig::onTransforms(const ros::TFMessage& message) {
  tree_.add(message);
  changed_ = true;
}

Result<void> Rig::onInfo(std::size_t index, const ros::CameraInfo& info) {
  Camera& camera = cameras_[index];
  if (camera.info && sameLens(*camera.info, info)) return {};
  const auto lens = ros::cameraOf(info, camera.is.rectified);
  if (!lens) return tl::unexpected(lens.error());
  if (!finite(*lens) || lens->width == 0 || lens->height == 0) {
    return fail("uncalibrated", camera.is.info_topic +
                                    " has values that are not finite, or no size; "
                                    "calibrate the camera again");
  }
  camera.info = info;
  camera.lens = *lens;
  if (camera.frame_id.empty()) camera.frame_id = ros::frameName(info.header.frame_id);
  changed_ = true;
  return {};
}

void Rig::onImageOf(std::size_t index, const std::string& frame_id, TimePoint time) {
  Camera& camera = cameras_[index];
  if (camera.frame_id.empty()) camera.frame_id = ros::frameName(frame_id), changed_ = true;
  if (camera.last && camera.intervals.size() < kIntervals) {
    const double interval = toSeconds(time - *camera.last);
    if (interval > 0.0) camera.intervals.push_back(interval), changed_ = true;
  }
  camera.last = time;
}

void Rig::onImuOf(const std::string& frame_id) {
  if (!imu_frame_.empty() || frame_id.empty()) return;
  imu_frame_ = ros::frameName(frame_id);
  changed_ = true;
}

void Rig::onOdometryOf(const std::string& child_frame_id) {
  if (!child_frame_.empty() || child_frame_id.empty()) return;
  child_frame_ = ros::frameName(child_frame_id);
  changed_ = true;
}

std::optional<CameraCalibration> Rig::calibrationOf(const Camera& camera) const {
  const CameraCalibration* in_rig = given_.camera(camera.is.name);
  if (in_rig == nullptr && !camera.lens) return std::nullopt;
  CameraCalibration calibration = in_rig ? *in_rig : *camera.lens;
  calibration.name = camera.is.name;
  if (in_rig == nullptr) {
    const auto T_BC = tree_.find(body(), camera.frame_id);
    if (!T_BC) return std::nullopt;
    calibration.T_BC = *T_BC;
  }
  if (camera.intervals.size() < kIntervals) return std::nullopt;
  if (calibration.rate_hz <= 0.0) calibration.rate_hz = rateOf(camera.intervals);
  return calibration;
}

std::optional<Calibration> Rig::news() {
  if (!changed_ || cameras_.empty() || body().empty()) return std::nullopt;
  changed_ = false;
  Calibration all;
  for (const Camera& camera : cameras_) {
    const auto one = calibrationOf(camera);
    if (!one) return std::nullopt;
    all.cameras.push_back(*one);
  }
  all.imu = given_.imu;
  const auto same = [](const CameraCalibration& a, const CameraCalibration& b) {
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
           a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
           a.distortion_coefficients == b.distortion_coefficients &&
           a.T_BC.matrix() == b.T_BC.matrix();
  };
  if (told_ && std::equal(told_->cameras.begin(), told_->cameras.end(), all.cameras.begin(),
                          all.cameras.end(), same)) {
    return std::nullopt;
  }
  told_ = all;
  return all;
}

std::string Rig::missingOf(const Camera& camera) const {
  const std::string& name = camera.is.name;
  if (given_.camera(name) == nullptr) {
    if (!camera.lens) {
      return "waits for a CameraInfo of " + name + " on " + camera.is.info_topic +
             ": let the driver publish it, set in." + name + ".info, or give in.rig";
    }
    if (!tree_.find(body(), camera.frame_id)) {
      return "waits for where " + name + " (frame `" + camera.frame_id +
             "`) is on the body (frame `" + body() +
             "`): no way between the two is on /tf_static; let robot_state_publisher or "
             "static_transform_publisher say it, or give in.rig";
    }
  }
  if (camera.intervals.size() < kIntervals) return "waits for images of " + name;
  return {};
}

std::string Rig::missing() const {
  if (has_imu_ && body_.empty() && imu_frame_.empty()) return "waits for inertial samples";
  if (!has_imu_ && has_odometry_ && body_.empty() && child_frame_.empty())
    return "waits for odometry";
  for (const Camera& camera : cameras_) {
    const std::string sentence = missingOf(camera);
    if (!sentence.empty()) return sentence;
  }
  return {};
}

std::optional<RigidTransform> Rig::bodyIn(const std::string& child_frame_id) const {
  const std::string child = ros::frameName(child_frame_id);
  const std::string to = body();
  if (to.empty() || to == child) return RigidTransform();
  return tree_.find(child, to);
}

}  // namespace perdure::ros2

#include "common/ros/mirror.h"

#include <algorithm>

#include "common/ros/autoware.h"
#include "common/ros/bytes.h"
#include "common/ros/definition.h"
#include "common/ros/frames.h"
#include "common/ros/images.h"
#include "common/ros/objects.h"
#include "common/ros/sensors.h"

namespace perdure::ros {
namespace {

std::string compressedTopic(const std::string& image) { return image + "/compressed"; }

}  // namespace

template <class M>
Outlet Mirror::outletOf(const std::string& topic, bool latched) const {
  return {topic, M::kType, latched, definitionOf<M>()};
}

void Mirror::say(const std::string& topic, auto make, bool latched) {
  using M = decltype(make());
  auto known = outlets_.find(topic);
  if (known == outlets_.end()) known = outlets_.emplace(topic, outletOf<M>(topic, latched)).first;
  if (latched || !wanted_ || wanted_(known->second)) out_(known->second, cdrOf(make()));
}

std::vector<Outlet> Mirror::outlets(const std::vector<std::string>& cameras) const {
  std::vector<Outlet> all{outletOf<TFMessage>("/tf"),
                          outletOf<TFMessage>("/tf_static", true),
                          outletOf<Odometry>(prefix_ + "/odometry"),
                          outletOf<Imu>(prefix_ + "/imu"),
                          outletOf<PointCloud2>(prefix_ + "/landmarks"),
                          outletOf<Detection2DArray>(prefix_ + "/detections"),
                          outletOf<Detection3DArray>(prefix_ + "/objects"),
                          outletOf<MarkerArray>(prefix_ + "/markers"),
                          outletOf<DiagnosticArray>(prefix_ + "/diagnostics")};
  if (!tracked_objects_.empty())
    all.push_back(outletOf<autoware::TrackedObjects>(tracked_objects_));
  if (wanted_) all.push_back(outletOf<PointCloud2>(prefix_ + "/obstacles"));
  if (clock_) all.push_back(outletOf<Clock>("/clock"));
  for (const std::string& camera : cameras) {
    all.push_back(outletOf<Image>(imageTopic(camera)));
    all.push_back(outletOf<CompressedImage>(compressedTopic(imageTopic(camera))));
    all.push_back(outletOf<CameraInfo>(prefix_ + "/" + camera + "/camera_info", true));
  }
  return all;
}

void Mirror::sayInfo(const CameraCalibration& camera, TimePoint time) {
  say(
      prefix_ + "/" + camera.name + "/camera_info", [&] { return infoOf(camera, time); }, true);
}

void Mirror::onCalibration(const Calibration& calibration) {
  calibration_ = calibration;
  say(
      "/tf_static", [&] { return fixedFrames(calibration); }, true);
  for (const CameraCalibration& camera : calibration.cameras) sayInfo(camera, newest_);
}

void Mirror::onImage(const Frame& frame) {
  const std::string topic = imageTopic(frame.camera);
  if (isCompressed(frame.encoding)) {
    say(compressedTopic(topic), [&] { return compressedOf(frame); });
  } else {
    say(topic, [&] { return imageOf(frame); });
  }
}

void Mirror::onFrame(const Frame& frame) {
  newest_ = std::max(newest_, frame.stamp.time);
  onImage(frame);
  const auto* camera = calibration_ ? calibration_->camera(frame.camera) : nullptr;
  if (camera != nullptr) sayInfo(*camera, frame.stamp.time);
}

void Mirror::onImu(const ImuSample& sample) {
  const bool known = calibration_ && calibration_->imu;
  imu_ = imuOf(sample, known ? &*calibration_->imu : nullptr);
  say(prefix_ + "/imu", [&] { return *imu_; });
}

RigidTransform Mirror::inMap(const WorldId& world) const {
  return map_frame_ && map_frame_->world == world ? map_frame_->T_MW : RigidTransform();
}

void Mirror::onOdometry(const perdure::Odometry& odometry) {
  if (clock_) say("/clock", [&] { return Clock{headerOf(odometry.stamp.time, "").stamp}; });
  if (odometry.state == OdometryState::kInitialising) return;
  newest_ = std::max(newest_, odometry.stamp.time);
  say(prefix_ + "/odometry", [&] { return odometryOf(odometry, imu_); });
  say("/tf",
      [&] { return movingFrames(odometry.stamp.time, inMap(odometry.world), odometry.T_WB); });
}

void Mirror::onLandmarks(const Landmarks& landmarks) {
  say(prefix_ + "/landmarks", [&] { return cloudOf(landmarks); });
}

void Mirror::onModel(const ModelInfo& model) {
  constexpr std::size_t kMostModels = 64;
  if (models_.size() < kMostModels || models_.contains(model.hash)) models_[model.hash] = model;
}

void Mirror::onDetections(const Detections& detections) {
  const auto model = models_.find(detections.model_hash);
  say(prefix_ + "/detections", [&] {
    return detections2dOf(detections, model == models_.end() ? nullptr : &model->second);
  });
}

void Mirror::onObjects(const Objects& objects) {
  say(prefix_ + "/objects", [&] { return detections3dOf(objects); });
  say(prefix_ + "/markers", [&] { return markersOf(objects); });
  if (wanted_) say(prefix_ + "/obstacles", [&] { return obstaclesOf(objects); });
  if (tracked_objects_.empty()) return;
  say(tracked_objects_, [&] { return autoware::trackedObjectsOf(objects, inMap(objects.world)); });
}

void Mirror::onHealth(const Health& health) {
  say(prefix_ + "/diagnostics", [&] {
    return DiagnosticArray{headerOf(newest_, ""), {statusOf(health)}};
  });
}

}  // namespace perdure::ros

#include "common/ros/mirror.h"

#include <algorithm>

#include "common/ros/bytes.h"
#include "common/ros/definition.h"
#include "common/ros/frames.h"
#include "common/ros/images.h"
#include "common/ros/objects.h"
#include "common/ros/sensors.h"

namespace perdure::ros {

template <class M>
void Mirror::say(const std::string& topic, const M& message, bool latched) {
  auto known = outlets_.find(topic);
  if (known == outlets_.end()) {
    known = outlets_.emplace(topic, Outlet{topic, M::kType, latched, definitionOf<M>()}).first;
  }
  out_(known->second, cdrOf(message));
}

void Mirror::sayInfo(const CameraCalibration& camera, TimePoint time) {
  say(prefix_ + "/" + camera.name + "/camera_info", infoOf(camera, time), true);
}

void Mirror::onCalibration(const Calibration& calibration) {
  calibration_ = calibration;
  say("/tf_static", fixedFrames(calibration), true);
  for (const CameraCalibration& camera : calibration.cameras) sayInfo(camera, newest_);
}

void Mirror::onFrame(const Frame& frame) {
  newest_ = std::max(newest_, frame.stamp.time);
  const std::string topic = prefix_ + "/" + frame.camera + "/image_raw";
  if (isCompressed(frame.encoding)) {
    say(topic + "/compressed", compressedOf(frame));
  } else {
    say(topic, imageOf(frame));
  }
  const auto* camera = calibration_ ? calibration_->camera(frame.camera) : nullptr;
  if (camera != nullptr) sayInfo(*camera, frame.stamp.time);
}

void Mirror::onImu(const ImuSample& sample) {
  gyro_ = sample.gyro;
  const bool known = calibration_ && calibration_->imu;
  say(prefix_ + "/imu", imuOf(sample, known ? &*calibration_->imu : nullptr));
}

RigidTransform Mirror::inMap(const WorldId& world) const {
  return map_frame_ && map_frame_->world == world ? map_frame_->T_MW : RigidTransform();
}

void Mirror::onOdometry(const perdure::Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return;
  newest_ = std::max(newest_, odometry.stamp.time);
  say(prefix_ + "/odometry", odometryOf(odometry, gyro_));
  say("/tf", movingFrames(odometry.stamp.time, inMap(odometry.world), odometry.T_WB));
}

void Mirror::onLandmarks(const Landmarks& landmarks) {
  say(prefix_ + "/landmarks", cloudOf(landmarks));
}

void Mirror::onModel(const ModelInfo& model) {
  constexpr std::size_t kMostModels = 64;
  if (models_.size() < kMostModels || models_.contains(model.hash)) models_[model.hash] = model;
}

void Mirror::onDetections(const Detections& detections) {
  const auto model = models_.find(detections.model_hash);
  say(prefix_ + "/detections",
      detections2dOf(detections, model == models_.end() ? nullptr : &model->second));
}

void Mirror::onObjects(const Objects& objects) {
  say(prefix_ + "/objects", detections3dOf(objects));
  say(prefix_ + "/markers", markersOf(objects));
}

void Mirror::onHealth(const Health& health) {
  say(prefix_ + "/diagnostics", DiagnosticArray{headerOf(newest_, ""), {statusOf(health)}});
}

}  // namespace perdure::ros

#include "tools/outputs/pictures/drive_log.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

/// The largest soft-max of a class; 0 without activations.
double bestProbability(const std::vector<float>& activations) {
  if (activations.size() < 2) return 0.0;
  const double top = *std::ranges::max_element(activations);
  double sum = 0.0;
  for (const float a : activations) sum += std::exp(a - top);
  return std::exp(*std::max_element(activations.begin() + 1, activations.end()) - top) / sum;
}

/// The number of the most probable class; 0 without activations.
std::size_t bestClass(const std::vector<float>& activations) {
  if (activations.size() < 2) return 0;
  const auto best = std::max_element(activations.begin() + 1, activations.end());
  return static_cast<std::size_t>(best - activations.begin());
}

}  // namespace

ObjectGlance glanceAt(const ObjectBelief& object) {
  const ClassBelief& best = object.best();
  ObjectGlance glance;
  glance.id = object.id;
  glance.class_name = best.name;
  glance.existence = object.existence;
  glance.moving = object.moving;
  glance.confirmed = object.confirmed;
  glance.visibility = object.visibility;
  glance.p_W = best.mean.head<3>();
  glance.p_covariance = best.covariance.topLeftCorner<3, 3>();
  glance.yaw = best.mean[3];
  glance.size = best.mean.tail<3>().array().exp();
  return glance;
}

std::array<Eigen::Vector3d, 8> cornersOf(const ObjectGlance& object) {
  std::array<Eigen::Vector3d, 8> corners;
  const Eigen::Matrix3d R = rotationAboutZ(object.yaw);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d half(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    corners[i] = object.p_W + R * half.cwiseProduct(object.size);
  }
  return corners;
}

FrameGlance& DriveLog::frameOf(const FrameStamp& stamp) {
  FrameGlance& frame = frames_[stamp.sequence];
  frame.stamp = stamp;
  return frame;
}

void DriveLog::add(const Objects& message) {
  FrameGlance& frame = frameOf(message.stamp);
  frame.has_objects = true;
  frame.T_WB = message.T_WB;
  frame.camera = camera_;
  frame.objects.clear();
  for (const ObjectBelief& object : message.objects) {
    if (!object.classes.empty()) frame.objects.push_back(glanceAt(object));
  }
}

void DriveLog::add(const Detections& message) {
  FrameGlance& frame = frameOf(message.stamp);
  frame.detections.clear();
  for (const Detection& one : message.detections) {
    if (one.primed) continue;  // an answer to a prediction; the network reported no box
    frame.detections.push_back(
        {one.box, bestProbability(one.activations), bestClass(one.activations)});
  }
}

}  // namespace perdure::tools

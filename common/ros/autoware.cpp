#include "common/ros/autoware.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "common/ros/frames.h"
#include "common/types/cuboid.h"

namespace perdure::ros::autoware {
namespace {

using Kinematics = TrackedObjectKinematics;
using Label = ObjectClassification;

std::uint8_t labelOf(const std::string& class_name) {
  static const std::map<std::string, std::uint8_t> kLabels = {
      {"car", Label::kCar},           {"van", Label::kCar},
      {"truck", Label::kTruck},       {"bus", Label::kBus},
      {"trailer", Label::kTrailer},   {"motorcycle", Label::kMotorcycle},
      {"bicycle", Label::kBicycle},   {"cyclist", Label::kBicycle},
      {"person", Label::kPedestrian}, {"pedestrian", Label::kPedestrian},
      {"dog", Label::kAnimal},        {"cat", Label::kAnimal},
      {"bird", Label::kAnimal},       {"horse", Label::kAnimal}};
  const auto found = kLabels.find(class_name);
  return found == kLabels.end() ? Label::kUnknown : found->second;
}

/// Returns one entry per label, the most probable first.
std::vector<ObjectClassification> classificationOf(const ObjectBelief& object) {
  std::map<std::uint8_t, double> sums;
  for (const ClassBelief& belief : object.classes) sums[labelOf(belief.name)] += belief.probability;
  std::vector<ObjectClassification> all;
  for (const auto& [label, sum] : sums) all.push_back({label, static_cast<float>(sum)});
  std::ranges::stable_sort(
      all, [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return all;
}

Uuid uuidOf(ObjectId id) {
  Uuid uuid;
  for (std::size_t i = 0; i < 8; ++i) {
    uuid.uuid[15 - i] = static_cast<std::uint8_t>((id >> (8 * i)) & 0xFFU);
  }
  return uuid;
}

std::array<double, 36> nothingKnown() {
  std::array<double, 36> numbers{};
  for (std::size_t i = 0; i < 6; ++i) numbers[7 * i] = kUnknownVariance;
  return numbers;
}

Kinematics kinematicsOf(const ObjectBelief& object, const Objects& all, const Cuboid& box,
                        const RigidTransform& T_MW) {
  constexpr double kMoves = 0.5, kAxisUnknown = 1.0;  // probability; σ of the yaw, rad
  Kinematics kinematics;
  kinematics.pose_with_covariance.pose = poseOf(T_MW * box.T_WO);
  kinematics.pose_with_covariance.covariance = poseCovarianceOf(object.best(), all.up_W, T_MW.R());
  const Eigen::Vector3d v = box.T_WO.R().transpose() * object.velocity;
  kinematics.twist_with_covariance.twist.linear = {v.x(), v.y(), v.z()};
  kinematics.twist_with_covariance.covariance = nothingKnown();
  kinematics.acceleration_with_covariance.covariance = nothingKnown();
  kinematics.is_stationary = object.moving < kMoves;
  const double sigma = std::sqrt(std::max(0.0, object.best().covariance(3, 3)));
  kinematics.orientation_availability = sigma > kAxisUnknown       ? Kinematics::kUnavailable
                                        : kinematics.is_stationary ? Kinematics::kSignUnknown
                                                                   : Kinematics::kAvailable;
  return kinematics;
}

}  // namespace

TrackedObjects trackedObjectsOf(const Objects& objects, const RigidTransform& T_MW) {
  TrackedObjects message{headerOf(objects.stamp.time, kMapFrame), {}};
  for (const ObjectBelief& object : objects.objects) {
    if (!object.confirmed) continue;
    const Cuboid box = cuboidOf(object, objects.up_W);
    TrackedObject tracked;
    tracked.object_id = uuidOf(object.id);
    tracked.existence_probability = static_cast<float>(object.existence);
    tracked.classification = classificationOf(object);
    tracked.kinematics = kinematicsOf(object, objects, box, T_MW);
    tracked.shape.dimensions = {box.size.x(), box.size.y(), box.size.z()};
    message.objects.push_back(std::move(tracked));
  }
  return message;
}

}  // namespace perdure::ros::autoware

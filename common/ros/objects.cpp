#include "common/ros/objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/ros/frames.h"
#include "common/types/class_colour.h"
#include "common/types/cuboid.h"

namespace perdure::ros {
namespace {

constexpr double kLeastScore = 0.01;

ObjectBelief withBest(const ObjectBelief& object, const ClassBelief& belief) {
  ObjectBelief one;
  one.id = object.id;
  one.classes = {belief};
  return one;
}

Detection3D detectionOf(const ObjectBelief& object, const Objects& all, const Header& header) {
  Detection3D detection;
  detection.header = header;
  detection.id = std::to_string(object.id);
  const Cuboid box = cuboidOf(object, all.up_W);
  detection.bbox = {poseOf(box.T_WO), {box.size.x(), box.size.y(), box.size.z()}};
  for (const ClassBelief& belief : object.classes) {
    ObjectHypothesisWithPose result;
    result.hypothesis = {belief.name, object.existence * belief.probability};
    result.pose.pose = poseOf(cuboidOf(withBest(object, belief), all.up_W).T_WO);
    result.pose.covariance = poseCovarianceOf(belief, all.up_W);
    detection.results.push_back(std::move(result));
  }
  return detection;
}

std::string classOf(std::size_t k, const ModelInfo* model) {
  return model != nullptr && k < model->classes.size() ? model->classes[k] : std::to_string(k);
}

/// Classes with their probabilities, the most probable first.
std::vector<ObjectHypothesis> hypothesesOf(const Detection& detection, const ModelInfo* model) {
  const auto& activations = detection.activations;
  if (activations.size() < 2) return {};
  const double most = *std::ranges::max_element(activations);
  double sum = 0.0;
  for (const float activation : activations) sum += std::exp(activation - most);
  std::vector<ObjectHypothesis> all;
  for (std::size_t k = 1; k < activations.size(); ++k) {
    const double score = std::exp(activations[k] - most) / sum;
    if (score >= kLeastScore) all.push_back({classOf(k - 1, model), score});
  }
  std::ranges::stable_sort(all, [](const auto& a, const auto& b) { return a.score > b.score; });
  return all;
}

ColorRGBA colourOf(const std::string& class_name, double alpha) {
  const Colour c = classColour(class_name);
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b),
          static_cast<float>(alpha)};
}

enum Part : std::int32_t { kFaces, kEdgesOf, kLabel, kParts };

Marker markerOf(const ObjectBelief& object, const Header& header, Part part) {
  Marker marker;
  marker.header = header;
  marker.ns = object.best().name;
  marker.id = static_cast<std::int32_t>((object.id * kParts + part) & 0x7FFFFFFFU);
  return marker;
}

void addMarkers(const ObjectBelief& object, const Objects& all, const Header& header,
                MarkerArray& markers) {
  const Cuboid box = cuboidOf(object, all.up_W);
  const std::string& name = object.best().name;
  const bool hidden = isHidden(object);
  const double opacity = isInSight(object) ? 0.9 : hidden ? 0.8 : 0.35;
  if (isInSight(object)) {
    Marker faces = markerOf(object, header, kFaces);
    faces.pose = poseOf(box.T_WO);
    faces.scale = {box.size.x(), box.size.y(), box.size.z()};
    faces.color = colourOf(name, 0.35 * object.existence);
    markers.markers.push_back(std::move(faces));
  }
  Marker edges = markerOf(object, header, kEdgesOf);
  edges.type = Marker::kLineList;
  edges.scale.x = 0.05;  // m
  edges.color = colourOf(name, opacity);
  for (const Eigen::Vector3d& end : strokesOf(box, hidden)) edges.points.push_back(pointOf(end));
  markers.markers.push_back(std::move(edges));
  Marker label = markerOf(object, header, kLabel);
  label.type = Marker::kText;
  constexpr double kAbove = 0.3, kTall = 0.4;  // m
  const Eigen::Vector3d up = box.T_WO.q * Eigen::Vector3d::UnitZ();
  label.pose.position = pointOf(box.T_WO.p + up * (box.size.z() / 2 + kAbove));
  label.scale.z = kTall;
  label.color = {1, 1, 1, static_cast<float>(opacity)};
  label.text = nameOf(object) + (hidden ? " (hidden)" : "");
  markers.markers.push_back(std::move(label));
}

using CloudPoint = std::pair<Eigen::Vector3d, double>;  ///< position in W, intensity

PointCloud2 cloudOf(TimePoint time, const std::vector<CloudPoint>& points) {
  constexpr std::array kNames{"x", "y", "z", "intensity"};
  PointCloud2 cloud;
  cloud.header = headerOf(time, kOdomFrame);
  for (std::uint32_t i = 0; i < kNames.size(); ++i)
    cloud.point_fields.push_back({kNames[i], 4 * i, PointField::kFloat32, 1});
  cloud.point_step = 4 * kNames.size();
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.row_step = cloud.width * cloud.point_step;
  auto data = std::make_shared<std::vector<std::uint8_t>>(cloud.row_step);
  std::uint8_t* to = data->data();
  for (const auto& [p, intensity] : points) {
    const std::array values{static_cast<float>(p.x()), static_cast<float>(p.y()),
                            static_cast<float>(p.z()), static_cast<float>(intensity)};
    std::memcpy(to, values.data(), sizeof values);
    to += sizeof values;
  }
  cloud.data = std::move(data);
  return cloud;
}

/// Adds points of the four sides of a box.
void addSides(const Cuboid& box, double intensity, std::vector<CloudPoint>& points) {
  constexpr double kAlong = 0.1, kUp = 0.25;  // m, largest distances
  constexpr double kMost = 200.0;             // steps, whatever the size
  const auto steps = [&](double length, double step) {
    return std::clamp(std::ceil(length / step), 1.0, kMost);
  };
  const Eigen::Vector3d half = box.size / 2.0;
  const double levels = steps(box.size.z(), kUp);
  for (const int axis : {0, 1}) {
    const double n = steps(box.size[axis], kAlong);
    for (double i = 0; i < n; ++i) {
      for (double level = 0; level <= levels; ++level) {
        Eigen::Vector3d p = -half;
        p[axis] += box.size[axis] * i / n;
        p.z() += box.size.z() * level / levels;
        points.emplace_back(box.T_WO * p, intensity);
        p.head<2>() *= -1.0;  // the opposite side
        points.emplace_back(box.T_WO * p, intensity);
      }
    }
  }
}

}  // namespace

Detection3DArray detections3dOf(const Objects& objects) {
  Detection3DArray array{headerOf(objects.stamp.time, kOdomFrame), {}};
  for (const ObjectBelief& object : objects.objects) {
    if (object.confirmed) array.detections.push_back(detectionOf(object, objects, array.header));
  }
  return array;
}

Detection2DArray detections2dOf(const Detections& detections, const ModelInfo* model) {
  Detection2DArray array{headerOf(detections.stamp.time, opticalFrame(detections.camera)), {}};
  for (const Detection& found : detections.detections) {
    if (found.primed) continue;
    Detection2D one;
    one.header = array.header;
    const Box& box = found.box;
    one.bbox = {{{(box.x1 + box.x2) / 2, (box.y1 + box.y2) / 2}, 0.0}, box.width(), box.height()};
    for (ObjectHypothesis& hypothesis : hypothesesOf(found, model)) {
      one.results.push_back({std::move(hypothesis), {}});
    }
    array.detections.push_back(std::move(one));
  }
  return array;
}

MarkerArray markersOf(const Objects& objects) {
  const Header header = headerOf(objects.stamp.time, kOdomFrame);
  MarkerArray array;
  array.markers.emplace_back();
  array.markers.back().header = header;
  array.markers.back().action = Marker::kDeleteAll;
  for (const ObjectBelief& object : objects.objects) {
    if (object.confirmed) addMarkers(object, objects, header, array);
  }
  return array;
}

Odometry odometryOf(const perdure::Odometry& odometry, const std::optional<Imu>& imu) {
  Odometry message;
  message.header = headerOf(odometry.stamp.time, kOdomFrame);
  message.child_frame_id = kBodyFrame;
  message.pose.pose = poseOf(odometry.T_WB);
  const Eigen::Matrix3d R = odometry.T_WB.R();
  // Jacobian from [θ in the body, p, v] to [p, θ in W] and to v in the body.
  Eigen::Matrix<double, 6, 9> J = Eigen::Matrix<double, 6, 9>::Zero();
  J.block<3, 3>(0, 3).setIdentity();
  J.block<3, 3>(3, 0) = R;
  message.pose.covariance = numbersOf(J * odometry.covariance * J.transpose());
  const Eigen::Vector3d v = R.transpose() * odometry.v_WB;
  Eigen::Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  J.setZero();
  J.block<3, 3>(0, 0) = cross;
  J.block<3, 3>(0, 6) = R.transpose();
  Matrix6 twist = J * odometry.covariance * J.transpose();
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  double noise = 0;
  if (imu) {
    const Vector3& rate = imu->angular_velocity;
    w = Eigen::Vector3d(rate.x, rate.y, rate.z) - odometry.gyro_bias;
    noise = imu->angular_velocity_covariance[0];
  }
  twist.bottomRightCorner<3, 3>().diagonal().setConstant(noise > 0 ? noise : kUnknownVariance);
  message.twist.twist = {{v.x(), v.y(), v.z()}, {w.x(), w.y(), w.z()}};
  message.twist.covariance = numbersOf(twist);
  return message;
}

PointCloud2 cloudOf(const Landmarks& landmarks) {
  std::vector<CloudPoint> points;
  for (const Landmark& one : landmarks.landmarks) {
    points.emplace_back(one.p_W, std::sqrt(std::max(0.0, one.covariance.trace() / 3.0)));
  }
  return cloudOf(landmarks.stamp.time, points);
}

PointCloud2 obstaclesOf(const Objects& objects) {
  std::vector<CloudPoint> points;
  for (const ObjectBelief& object : objects.objects) {
    if (object.confirmed) addSides(cuboidOf(object, objects.up_W), object.existence, points);
  }
  return cloudOf(objects.stamp.time, points);
}
DiagnosticStatus statusOf(const Health& health) {
  using Status = DiagnosticStatus;
  DiagnosticStatus status;
  const bool good = health.state == HealthState::kOk;
  const auto level = good                                   ? Status::kOk
                     : health.state == HealthState::kFailed ? Status::kError
                                                            : Status::kWarn;
  status.level = std::byte{level};
  status.name = "perdure/" + health.process;
  status.hardware_id = health.process;
  status.message = !health.message.empty()                  ? health.message
                   : health.state == HealthState::kStarting ? "starting"
                                                            : "good";
  const auto add = [&](const std::string& key, const auto& value) {
    status.values.push_back({key, fmt::format("{}", value)});
  };
  add("frames_in", health.frames_in), add("frames_out", health.frames_out);
  add("dropped", health.dropped), add("rate_hz", health.rate_hz);
  add("cpu_s", health.cpu_s), add("rss_bytes", health.rss_bytes);
  for (const auto& [reason, n] : health.reasons) add(reason, n);
  return status;
}

}  // namespace perdure::ros

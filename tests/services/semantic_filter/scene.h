// A street of true cuboids, a camera that drives through it, and the boxes that a network would
// report.
#pragma once

#include <random>
#include <vector>

#include "services/semantic_filter/core/filter.h"
#include "services/semantic_filter/node.h"

namespace perdure::semantic_filter::testing {

inline CameraCalibration makeCamera() {
  CameraCalibration c;
  c.name = "cam0";
  c.width = 1242;
  c.height = 375;
  c.fx = c.fy = 720.0;
  c.cx = 620.0;
  c.cy = 180.0;
  Eigen::Matrix3d R;  // camera in body: z forward along body x, x right, y down
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  c.T_BC = RigidTransform(R, Eigen::Vector3d(0.3, 0.0, 0.5));
  return c;
}

inline State makeState(double x, double y, double z, double yaw, double l, double w, double h) {
  State s = State::Zero();
  s.head<kBias>() << x, y, z, yaw, std::log(l), std::log(w), std::log(h);
  return s;
}

inline ClassPrior makePrior(const std::string& name, double l, double w, double h, double sigma) {
  ClassPrior p;
  p.name = name;
  p.log_size << std::log(l), std::log(w), std::log(h);
  p.log_size_covariance = sigma * sigma * Eigen::Matrix3d::Identity();
  p.detection_probability = 0.9;
  return p;
}

inline ClassPriors makePriors() {
  ClassPriors priors;
  priors.fallback = makePrior("", 0.7, 0.7, 0.7, 0.5);
  priors.other = makePrior(kOtherClass, 1.0, 1.0, 1.0, 0.35);
  priors.other.log_size_covariance.array() += 0.25;
  priors.other.has_yaw = false;
  priors.classes = {makePrior("car", 4.2, 1.75, 1.5, 0.1), makePrior("chair", 0.5, 0.5, 0.9, 0.12),
                    makePrior("dining table", 1.0, 1.6, 0.75, 0.15),
                    makePrior("van", 5.0, 1.9, 2.1, 0.12)};
  return priors;
}

inline ModelInfo makeModelInfo() {
  ModelInfo info;
  info.hash = 17;
  info.name = "synthetic";
  info.classes = {"car", "chair", "dining table", "van"};
  return info;
}

struct TrueObject {
  State x;
  std::string class_name;
};

/// The box of a true object, with noise on its sides and cut at the image border; nothing if out of
/// view.
template <class Random>
std::optional<Detection> detect(const TrueObject& object, const View& view,
                                const BoxParameters& box, double noise, double log_ratio,
                                Random& random) {
  const auto p = projectObserved(object.x, view, BoxStyle());
  if (!p) return std::nullopt;
  const double w = view.camera->width(), h = view.camera->height();
  Eigen::Vector4d s = p->sides;
  std::normal_distribution<double> normal;
  const double size[2] = {s[2] - s[0], s[3] - s[1]};
  for (int i = 0; i < 4; ++i) {
    s[i] += noise * (box.sigma_px + box.sigma_relative * size[i % 2]) * normal(random);
  }
  Detection d;
  d.box = {std::clamp(s[0], 0.0, w), std::clamp(s[1], 0.0, h), std::clamp(s[2], 0.0, w),
           std::clamp(s[3], 0.0, h)};
  if (d.box.width() < 4 || d.box.height() < 4) return std::nullopt;
  d.activations = {0.0F};
  for (const auto& name : makeModelInfo().classes) {
    d.activations.push_back(static_cast<float>(name == object.class_name ? log_ratio : -log_ratio));
  }
  return d;
}

/// A track that was detected four times, with the same variance in each of its seven numbers.
inline Track makeObject(ObjectId id, const std::string& name, const State& x, double variance) {
  Track o;
  o.id = id;
  o.existence = {0.9, ExistenceEvidence::kPrior, o.as_of};
  o.life.first_seen = fromNanoseconds(static_cast<std::int64_t>(id));
  o.life.hits = 4;
  o.visibility.fraction = 1.0;
  Hypothesis h;
  h.class_name = name;
  h.weight = 1.0;
  h.x = x;
  h.P.setZero();
  h.P.diagonal().head<7>().setConstant(variance);
  o.hypotheses = {h};
  return o;
}

/// A frame from the origin, with the usual camera, classes and parameters.
struct UsualFrame {
  UsualFrame() {
    frame.view.camera = &camera;
    frame.model = &model;
    frame.priors = &priors;
    frame.parameters = &parameters;
  }
  UsualFrame(const UsualFrame&) = delete;
  CameraModel camera{makeCamera()};
  Model model = makeModel(makeModelInfo());
  ClassPriors priors = makePriors();
  Parameters parameters;
  FrameContext frame;
};

inline FrameStamp stampOf(std::uint64_t k) {
  FrameStamp s;
  s.source = 1;
  s.sequence = k;
  s.time = fromNanoseconds(static_cast<std::int64_t>(k) * 100'000'000);
  return s;
}

inline Odometry odometryAt(std::uint64_t k, const RigidTransform& T_WB) {
  Odometry o;
  o.stamp = stampOf(k);
  o.instance = 2;
  o.world = {5, 0};
  o.state = OdometryState::kTracking;
  o.T_WB = T_WB;
  return o;
}

/// The body drives along x with a slight bend, `metres` per frame.
inline RigidTransform driveTo(std::uint64_t k, double metres) {
  const double s = static_cast<double>(k) * metres;
  return RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(0.002 * s, Eigen::Vector3d::UnitZ())),
                        Eigen::Vector3d(s, 0.001 * s * s, 1.2));
}

inline Detections detectionsAt(std::uint64_t k, std::vector<Detection> list) {
  Detections d;
  d.stamp = stampOf(k);
  d.camera = "cam0";
  d.instance = 3;
  d.model_hash = makeModelInfo().hash;
  d.detections = std::move(list);
  return d;
}

inline Calibration calibrationOf(const CameraCalibration& camera) {
  Calibration c;
  c.cameras.push_back(camera);
  return c;
}

/// A node and its published messages.
struct Harness {
  std::vector<Objects> objects;
  std::vector<Event> events;
  Node node;

  explicit Harness(const Config& config = {}, InstanceId instance = 9)
      : node(config, makePriors(), instance,
             {[this](const Objects& m) { objects.push_back(m); },
              [this](const Event& e) { events.push_back(e); },
              {}}) {
    node.onCalibration(calibrationOf(makeCamera()));
    node.onModel(makeModelInfo());
  }
};

}  // namespace perdure::semantic_filter::testing

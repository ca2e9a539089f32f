#include "tests/bench/filter_drive.h"

#include <algorithm>
#include <ctime>

#include "services/semantic_filter/priors.h"
#include "tests/bench/allocations.h"

namespace perdure::semantic_filter::bench {
namespace {

using testing::TrueObject;

constexpr double kMetresAFrame = 0.25, kAhead = 45.0, kHalfWidth = 22.0;
constexpr double kFalseBoxes = 2.0, kDetected = 0.9;

double cpuMs() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

CameraCalibration makeLookout() {
  CameraCalibration camera = testing::makeCamera();
  camera.height = 720;
  camera.cy = 300.0;
  // 3 m above the body and 12° down, so that objects seldom occlude each other.
  const Eigen::AngleAxisd down(0.21, Eigen::Vector3d::UnitY());
  camera.T_BC = RigidTransform(down.toRotationMatrix() * camera.T_BC.R(), {0.0, 0.0, 3.0});
  return camera;
}

ModelInfo makeModelOfField() {
  ModelInfo info;
  info.hash = 17;
  info.name = "synthetic";
  info.classes = {"car", "chair", "person"};
  return info;
}

}  // namespace

Field::Field(std::size_t in_view, std::uint32_t seed) : random_(seed) {
  density_ = 1.3 * static_cast<double>(in_view) / kAhead;
}

const std::deque<TrueObject>& Field::near(double x) {
  for (; planted_ < x + kAhead; planted_ += 1.0 / density_) plant();
  while (!things_.empty() && things_.front().x.x() < x - 2.0) things_.pop_front();
  return things_;
}

void Field::plant() {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int attempt = 0; attempt < 50; ++attempt) {
    const double side = (u(random_) < 0.5 ? -1.0 : 1.0) * (1.5 + kHalfWidth * u(random_));
    const double yaw = 2.0 * M_PI * u(random_), kind = u(random_);
    TrueObject thing =
        kind < 0.5 ? TrueObject{testing::makeState(planted_, side, 0.45, yaw, .5, .5, .9), "chair"}
        : kind < 0.9
            ? TrueObject{testing::makeState(planted_, side, 0.87, yaw, .5, .6, 1.74), "person"}
            : TrueObject{testing::makeState(planted_, side, 0.75, yaw, 4.2, 1.8, 1.5), "car"};
    const double room = kind < 0.9 ? 1.2 : 4.5;
    const bool free = std::none_of(things_.begin(), things_.end(), [&](const TrueObject& o) {
      return (o.x - thing.x).head<2>().norm() < room;
    });
    if (!free) continue;
    things_.push_back(thing);
    return;
  }
}

Drive::Drive(const Config& config, std::size_t in_view, std::uint32_t seed)
    : field_(in_view, seed),
      random_(seed + 1),
      camera_(makeLookout()),
      model_(camera_),
      node_(config, loadPriors(config), 9, {[this](const Objects& m) { count(m); }, {}, {}}) {
  node_.onCalibration(testing::calibrationOf(camera_));
  node_.onModel(makeModelOfField());
}

Sample Drive::frame(std::uint64_t k) {
  Odometry odometry = testing::odometryAt(k, testing::driveTo(0, 0.0));
  const double s = kMetresAFrame * static_cast<double>(k);
  odometry.T_WB = RigidTransform(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.02 * std::sin(0.3 * s), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(s, 0.0, odometry.T_WB.p.z()));
  odometry.has_increment = true;
  odometry.transition.setIdentity();
  odometry.increment_covariance.diagonal().setConstant(1e-8);
  odometry.covariance.diagonal().setConstant(1e-4);
  const Detections detections = look(k, odometry.T_WB);
  const auto before = tests::allocations();
  const double start = cpuMs();
  node_.onOdometry(odometry);
  node_.onDetections(detections);
  Sample sample;
  sample.cpu_ms = cpuMs() - start;
  sample.allocations = tests::allocationsSince(before).own;
  sample.boxes = detections.detections.size();
  sample.objects = objects_;
  sample.in_view = in_view_;
  return sample;
}

void Drive::count(const Objects& message) {
  objects_ = message.objects.size();
  in_view_ = static_cast<std::size_t>(
      std::count_if(message.objects.begin(), message.objects.end(),
                    [](const ObjectBelief& o) { return o.visible_fraction > 0.0; }));
}

Detections Drive::look(std::uint64_t k, const RigidTransform& T_WB) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<Detection> list;
  const View view{&model_, T_WB, Eigen::Vector3d::UnitZ()};
  for (const TrueObject& thing : field_.near(T_WB.p.x())) {
    if (u(random_) > kDetected) continue;
    auto d = testing::detect(thing, view, BoxParameters{}, 1.0, 4.0, random_);
    if (!d || d->box.width() * d->box.height() < 100.0) continue;
    d->activations = {0.0F};
    for (const auto& name : makeModelOfField().classes) {
      d->activations.push_back(name == thing.class_name ? 4.0F : -4.0F);
    }
    list.push_back(*d);
  }
  for (int i = std::poisson_distribution<int>(kFalseBoxes)(random_); i > 0; --i) {
    const double w = 20.0 + 80.0 * u(random_), h = 20.0 + 80.0 * u(random_);
    const double x = (camera_.width - w) * u(random_), y = (camera_.height - h) * u(random_);
    list.push_back({});
    list.back().box = {x, y, x + w, y + h};
    list.back().activations = {0.0F, -2.0F, -1.0F, -2.0F};
  }
  return testing::detectionsAt(k, std::move(list));
}

}  // namespace perdure::semantic_filter::bench

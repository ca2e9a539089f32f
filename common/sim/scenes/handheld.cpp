#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "common/sim/scenes/parts/rooms.h"

namespace perdure::sim {
namespace {

constexpr double kStepHz = 1.8, kWalkingSpeed = 0.8;

/// Hand motion: steps move it vertically and sideways in proportion to the speed; at rest it
/// trembles.
Eigen::Vector3d handAt(double t_s, double speed) {
  const double walking = std::min(1.0, speed / kWalkingSpeed), step = 2.0 * M_PI * kStepHz * t_s;
  return {0.004 * walking * std::sin(step + 0.7), 0.016 * walking * std::sin(0.5 * step),
          0.014 * walking * std::sin(step) + 0.0015 * std::sin(2.0 * M_PI * 0.31 * t_s)};
}

RigidTransform bodyPose(const Look& look, const Eigen::Vector3d& hand, double height) {
  const Eigen::Quaterniond heading = expQuaternion({0, 0, look.yaw});
  const Eigen::Quaterniond q =
      heading * expQuaternion({0, look.pitch_down, 0}) * expQuaternion({look.roll, 0, 0});
  return RigidTransform(q,
                        Eigen::Vector3d(look.point.x(), look.point.y(), height) + heading * hand);
}

}  // namespace

Trajectory handheldMotion(const std::vector<Look>& looks, double interval_s, double height) {
  std::vector<RigidTransform> controls;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const Look& after = looks[std::min(i + 1, looks.size() - 1)];
    const Look& before = looks[i > 0 ? i - 1 : 0];
    const double speed = (after.point - before.point).norm() / (2.0 * interval_s);
    const double t = interval_s * static_cast<double>(i);
    controls.push_back(bodyPose(looks[i], handAt(t, speed), height));
  }
  return Trajectory(0.0, interval_s, std::move(controls));
}

Trajectory handheldMotion(const GroundPath& path, const Drive& drive, double height) {
  std::vector<Look> looks;
  for (std::size_t i = 0; i < drive.distance.size(); ++i) {
    const double t = drive.interval_s * static_cast<double>(i);
    const PathPoint p = path.at(drive.distance[i]);
    // The gaze begins to wander with the walk; before, the camera is steady.
    const double begun = std::clamp((t - 1.0) / 2.0, 0.0, 1.0);
    const double wanders = begun * begun * (3.0 - 2.0 * begun);
    const auto wave = [&](double period) { return wanders * std::sin(2.0 * M_PI * t / period); };
    Look look;
    look.point = p.position;
    look.yaw = p.heading + wave(13.0) + 0.18 * wave(4.7);  // turns to both sides
    look.pitch_down = 0.12 + 0.07 * wave(2.9);
    look.roll = 0.05 * wave(4.3);
    looks.push_back(look);
  }
  return handheldMotion(looks, drive.interval_s, height);
}

}  // namespace perdure::sim

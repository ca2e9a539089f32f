// Streets with front gardens, whose hedges and walls hide cars in driveways; driven in both
// directions.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "common/math/so3.h"
#include "common/sim/path.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kSuburbSeconds = 305.0;
constexpr int kSuburbColumns = 4, kSuburbRows = 4;
constexpr double kShareMoving = 0.02;  ///< share of moving vehicles; drive 00 of KITTI: 7 of 440
constexpr double kPassing_s = 4.0;     ///< an oncoming car is present for so long before and after

/// The route drives rows 0 and 3 twice in one direction, and rows 0 and 2 and the outer columns
/// also back.
std::vector<Eigen::Vector2d> turnsInSuburb() {
  constexpr std::array kRoute{0, 30, 32, 2, 0, 30, 33, 3, 1, 31, 30, 0, 2, 32, 33, 3};
  std::vector<Eigen::Vector2d> points;
  for (const int crossing : kRoute)  // ten times the column, plus the row
    points.emplace_back(kGridX * (crossing / 10), kGridY * (crossing % 10));
  return points;
}

/// Draws a time around which the body drives straight on for kPassing_s. Empty if 50 attempts fail.
std::optional<double> straightWithin(double from_s, double until_s, SceneBuilder& builder) {
  const Trajectory& body = builder.scene().body;
  for (int attempt = 0; attempt < 50; ++attempt) {
    const double t = builder.dice().uniform(from_s, until_s), yaw = yawOf(body.poseAt(t).R());
    bool straight = body.at(t).velocity_W.norm() > 5.0;
    for (double s = t - kPassing_s; s <= t + kPassing_s; s += 0.5) {
      straight = straight && std::abs(wrapAngle(yawOf(body.poseAt(s).R()) - yaw)) < 0.03;
    }
    if (straight) return t;
  }
  return std::nullopt;
}

/// Adds oncoming cars, each of which passes the body on a straight. They appear too far away to be
/// detected. Each has its own part of the drive, so that they do not meet.
void addOncoming(SceneBuilder& builder, std::size_t count, double seconds) {
  constexpr double kSpeed = 8.0, kHalfPath = 60.0;
  const double part = seconds / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double first = part * static_cast<double>(i);
    const auto t = straightWithin(first + kPassing_s, first + part - kPassing_s, builder);
    if (!t) continue;
    const RigidTransform T_WB = builder.scene().body.poseAt(*t);
    const double yaw = yawOf(T_WB.R());
    const Eigen::Vector2d ahead(std::cos(yaw), std::sin(yaw)), left(-ahead.y(), ahead.x());
    const Eigen::Vector2d meeting = T_WB.p.head<2>() + 2.0 * kLane * left;
    const GroundPath way({{meeting + kHalfPath * ahead}, {meeting - kHalfPath * ahead}}, false);
    SceneObject car = builder.draw("car");
    const Drive driven = cruise(kHalfPath - 6.0 * kSpeed, kSpeed, *t - 6.0, *t + 6.0);
    const Trajectory motion = uprightMotion(way, driven, 0.5 * car.size.z());
    car.present_from_s = *t - kPassing_s;
    car.present_until_s = *t + kPassing_s;
    builder.putMoving(std::move(car), motion);
  }
}

Furnishing furnishingOfSuburb() {
  Furnishing furnishing = furnishingOfGrid();
  furnishing.free_share = 0.5;
  furnishing.hedge_share = 0.0;  // hedges are those of the gardens
  furnishing.pavement = 1.8;
  furnishing.garden = 6.5;
  furnishing.island_share = 0.4;
  return furnishing;
}

}  // namespace

Scene makeSuburb(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("suburb", seed, options);
  const double seconds = builder.seconds(kSuburbSeconds);
  const double planned = std::max(seconds, kSuburbSeconds);
  const GroundPath way = laneThrough(turnsInSuburb());
  const SpeedLimits limits{10.5, 2.4, 1.7, 1.9};
  const Drive driven = drive(way, limits, 8.0, way.length() - 8.0, 1.2, planned + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  Streets(builder, gridOfRoads(kSuburbColumns, kSuburbRows), furnishingOfSuburb()).furnish();
  const auto& objects = builder.scene().objects;
  const auto vehicles = std::ranges::count_if(
      objects, [](const SceneObject& o) { return o.class_name == "car" || o.class_name == "van"; });
  addOncoming(builder, static_cast<std::size_t>(kShareMoving * static_cast<double>(vehicles) + 0.5),
              planned);
  return builder.take();
}

}  // namespace perdure::sim

#include "common/sim/scenes/parts/views.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "common/sim/scenes/parts/rigs.h"

namespace perdure::sim {
namespace {

constexpr double kSmallestPx = 11.0, kLargestPx = 330.0;  ///< longer side; width 320
constexpr double kFocalAt320 = 190.7;

/// Approximate extent of the outline, seen from any side.
double extentOf(const SceneObject& object) {
  return std::max(object.size.z(), 0.5 * (object.size.x() + object.size.y()));
}

}  // namespace

ViewFinder::ViewFinder(SceneBuilder& builder, const Area& area, double top_speed)
    : builder_(builder), area_(area), top_speed_(top_speed) {
  for (const Prop& prop : builder.scene().props) {
    const auto solids = solidsOf(prop);
    scenery_.insert(scenery_.end(), solids.begin(), solids.end());
  }
  const auto& objects = builder.scene().objects;
  for (const std::string& name : truthClasses()) {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].class_name == name) indices.push_back(i);
    }
    if (!indices.empty()) by_class_.emplace_back(name, std::move(indices));
  }
}

View ViewFinder::draw() {
  Dice& dice = builder_.dice();
  for (int attempt = 0; attempt < 60; ++attempt) {
    const auto& indices = dice.pick(by_class_).second;
    const auto view = lookAt(builder_.scene().objects[dice.pick(indices)]);
    if (view) return *view;
  }
  // No object was visible; choose a random view without a target.
  for (;;) {
    const Eigen::Vector2d point(dice.uniform(area_.low.x(), area_.high.x()),
                                dice.uniform(area_.low.y(), area_.high.y()));
    const Solid camera{point, 0.0, {0.2, 0.2}, 0.0, 2.0};
    if (!builder_.isFree(camera, 0.1)) continue;
    return viewFrom({point.x(), point.y(), 1.5}, dice.uniform(-M_PI, M_PI), 0.1);
  }
}

std::optional<View> ViewFinder::lookAt(const SceneObject& object) {
  Dice& dice = builder_.dice();
  // Most objects in real images are small.
  const double share = std::pow(dice.unit(), 1.3);
  const double span = kSmallestPx * std::pow(kLargestPx / kSmallestPx, share);
  const double distance =
      kFocalAt320 * extentOf(object) / span + 0.3 * object.size.head<2>().norm();
  const double height = dice.chance(0.12) ? dice.uniform(0.5, 1.0) : dice.uniform(1.1, 2.1);
  const auto point = standAt(object, distance, height);
  if (!point) return std::nullopt;
  const Eigen::Vector3d centre = object.motion.poseAt(0.0).p;
  const Eigen::Vector2d way = centre.head<2>() - *point;
  // Large objects stay near the centre of the image; small ones may be anywhere.
  const double freedom = 1.0 - 0.75 * share;
  const double yaw = std::atan2(way.y(), way.x()) + freedom * dice.uniform(-0.62, 0.62);
  const double pitch =
      std::atan2(height - centre.z(), way.norm()) + freedom * dice.uniform(-0.4, 0.4);
  return viewFrom({point->x(), point->y(), height}, yaw, pitch);
}

std::optional<Eigen::Vector2d> ViewFinder::standAt(const SceneObject& object, double distance,
                                                   double height) {
  Dice& dice = builder_.dice();
  const Eigen::Vector2d centre = object.motion.poseAt(0.0).p.head<2>();
  for (int attempt = 0; attempt < 30; ++attempt) {
    const double bearing = dice.uniform(-M_PI, M_PI);
    const Eigen::Vector2d point =
        centre + distance * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    const bool inside =
        (point.array() > area_.low.array()).all() && (point.array() < area_.high.array()).all();
    const Solid camera{point, 0.0, {0.2, 0.2}, height - 0.2, height + 0.2};
    if (!inside || !builder_.isFree(camera, 0.1)) continue;
    if (sees({point.x(), point.y(), height}, object)) return point;
  }
  return std::nullopt;
}

/// Returns true if at least two of five points of the object are visible.
bool ViewFinder::sees(const Eigen::Vector3d& eye, const SceneObject& object) const {
  const RigidTransform T_WO = object.motion.poseAt(0.0);
  int seen = 0;
  for (const Eigen::Vector3d& part :
       {Eigen::Vector3d(0, 0, 0.2), Eigen::Vector3d(0.35, 0.35, 0.3),
        Eigen::Vector3d(0.35, -0.35, 0.3), Eigen::Vector3d(-0.35, 0.35, 0.3),
        Eigen::Vector3d(-0.35, -0.35, 0.3)}) {
    const Eigen::Vector3d target = T_WO * part.cwiseProduct(object.size);
    const auto hides = [&](const Solid& solid) { return blocks(solid, eye, target); };
    const bool by_object =
        std::ranges::any_of(builder_.scene().objects, [&](const SceneObject& other) {
          return other.id != object.id && hides(solidOf(other, 0.0));
        });
    if (!by_object && std::ranges::none_of(scenery_, hides)) ++seen;
  }
  return seen >= 2;
}

View ViewFinder::viewFrom(const Eigen::Vector3d& eye, double yaw, double pitch_down) {
  Dice& dice = builder_.dice();
  const double roll = dice.chance(0.12) ? dice.uniform(-1.05, 1.05) : 0.05 * dice.normal();
  const Eigen::Quaterniond q =
      expQuaternion({0, 0, yaw}) * expQuaternion({0, pitch_down, 0}) * expQuaternion({roll, 0, 0});
  View view;
  view.T_WB = RigidTransform(q, eye - Eigen::Vector3d(0, 0, kCameraAboveBody));
  view.velocity_W = q * Eigen::Vector3d(dice.uniform(0.0, top_speed_), 0, 0);
  view.turn_rate_B = 0.15 * Eigen::Vector3d(dice.normal(), dice.normal(), 2.0 * dice.normal());
  return view;
}

Trajectory throughViews(const std::vector<View>& views) {
  constexpr int kControls = 10;  // number per second; the middle seven form the view
  std::vector<RigidTransform> controls;
  for (const View& view : views) {
    for (int i = -kControls / 2; i < kControls / 2; ++i) {
      const double dt = 1.0 / kControls * i;
      controls.emplace_back(view.T_WB.q * expQuaternion(dt * view.turn_rate_B),
                            view.T_WB.p + dt * view.velocity_W);
    }
  }
  return Trajectory(-0.5, 1.0 / kControls, std::move(controls));
}

}  // namespace perdure::sim

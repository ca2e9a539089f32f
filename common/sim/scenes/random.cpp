// Streets or rooms with objects anywhere, and a camera that changes its pose every second.
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "common/math/so3.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/rooms.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kRandomSeconds = 40.0;
constexpr double kSmallestPx = 11.0, kLargestPx = 330.0;  ///< longer side; width 320
constexpr double kFocalAt320 = 190.7;

double extentOf(const SceneObject& object) {
  return std::max(object.size.z(), 0.5 * (object.size.x() + object.size.y()));
}

struct Area {
  Eigen::Vector2d low, high;
};

struct View {
  RigidTransform T_WB;
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), turn_rate_B = Eigen::Vector3d::Zero();
};

class ViewFinder {
 public:
  ViewFinder(SceneBuilder& builder, const Area& area, double top_speed);

  /// Draws a view of an object. Its class is drawn uniformly from the classes in the scene.
  View draw();

 private:
  std::optional<View> lookAt(const SceneObject& object);
  std::optional<Eigen::Vector2d> standAt(const SceneObject& object, double distance, double height);
  bool sees(const Eigen::Vector3d& eye, const SceneObject& object) const;
  View viewFrom(const Eigen::Vector3d& eye, double yaw, double pitch_down);

  SceneBuilder& builder_;
  Area area_;
  double top_speed_;
  std::vector<Solid> scenery_;  ///< possible occluders
  std::vector<std::pair<std::string, std::vector<std::size_t>>> by_class_;
};

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
  // No object was visible: draws a view without a target.
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
  // Large objects are near the centre of the image; small ones may be anywhere.
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

/// Whether at least two of five points of the object are visible.
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

/// Passes one view per second with the view's velocity; the motion between views is arbitrary.
Trajectory throughViews(const std::vector<View>& views) {
  constexpr int kControls = 10;  // controls per second; the middle seven form the view
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

/// Builds two crossing streets with their usual objects, and adds objects at unusual places.
Area makeOutdoors(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double length = dice.uniform(35.0, 55.0), width = dice.uniform(8.0, 12.0);
  const double turn = dice.uniform(0.0, M_PI);
  const Eigen::Vector2d way(std::cos(turn), std::sin(turn)), across(-way.y(), way.x());
  const Eigen::Vector2d crossing = dice.uniform(-0.5, 0.5) * length * way;
  Furnishing furnishing;
  furnishing.mean_gap = dice.uniform(0.8, 4.0);
  furnishing.free_share = dice.uniform(0.2, 0.5);
  furnishing.van_share = dice.uniform(0.2, 0.6);
  furnishing.reversed_share = 0.4;
  furnishing.pavement = dice.uniform(2.6, 5.0);
  furnishing.person_every = dice.uniform(6.0, 14.0);
  furnishing.bicycle_every = dice.uniform(6.0, 14.0);
  furnishing.hedge_share = dice.uniform(0.0, 0.6);
  Streets streets(builder,
                  {{-length * way, length * way, width},
                   {crossing - 30.0 * across, crossing + 30.0 * across, width}},
                  furnishing);
  streets.furnish();
  const auto anywhere = [&] {
    const double along = dice.uniform(-0.9, 0.9) * length;
    return Eigen::Vector2d(along * way + dice.uniform(-0.7, 0.7) * width * across);
  };
  for (const char* name : {"car", "van", "person", "bicycle"}) {
    for (int i = 0; i < 5; ++i) {
      builder.put(builder.draw(name), {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
    }
  }
  for (const char* name : {"chair", "dining table", "couch"}) {
    if (dice.chance(0.3))
      builder.put(builder.draw(name), {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
  }
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d size(dice.uniform(0.3, 1.2), dice.uniform(0.3, 0.9),
                               dice.uniform(0.3, 1.4));
    builder.put(PropKind::kCrate, size, {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
  }
  drawDaylight(builder);
  const double reach = length + 5.0;
  return {{-reach, -reach}, {reach, reach}};
}

Area makeIndoors(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  Room room(builder, dice.uniform(7.0, 14.0), dice.uniform(6.0, 10.0));
  const int tables = 1 + static_cast<int>(dice.below(3));
  for (int i = 0; i < tables; ++i) {
    const Eigen::Vector2d point(dice.uniform(-0.3, 0.3) * room.length(),
                                dice.uniform(-0.3, 0.3) * room.width());
    room.putTable(point, dice.uniform(-M_PI, M_PI), static_cast<int>(dice.below(6)),
                  static_cast<int>(dice.below(3)));
  }
  room.furnishWalls();
  room.scatter("chair", 2);
  room.scatter("couch", 1);
  room.scatter("person", 1 + static_cast<int>(dice.below(3)));
  if (dice.chance(0.3)) room.scatter("bicycle", 1);
  room.scatterCrates(2);
  const Eigen::Vector2d half(0.5 * room.length() - 0.3, 0.5 * room.width() - 0.3);
  return {-half, half};
}

}  // namespace

Scene makeRandom(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("random", seed, options);
  Dice& dice = builder.dice();
  builder.scene().seconds = builder.seconds(kRandomSeconds);
  builder.scene().rig = makeRig(Carrier::kHand, options, dice, 0.0);
  const bool outdoors = seed % 2 == 0;
  const Area area = outdoors ? makeOutdoors(builder) : makeIndoors(builder);
  ViewFinder finder(builder, area, outdoors ? 7.0 : 0.8);
  std::vector<View> views;
  for (double t = 0.0; t <= builder.scene().seconds; t += 1.0) views.push_back(finder.draw());
  builder.scene().body = throughViews(views);
  return builder.take();
}

}  // namespace perdure::sim

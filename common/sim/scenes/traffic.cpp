// A street with traffic: a car ahead, oncoming, crossing and parking cars, pedestrians.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kTrafficSeconds = 40.0, kForever = 1e9;
constexpr double kParked =
    0.5 * kRoadWidth - 0.18 - 0.9;  ///< centre of a parked car, from the road's centre line
constexpr double kFarEnd = 420.0, kNearEnd = -60.0, kCrossing = 150.0;

class Traffic {
 public:
  Traffic(SceneBuilder& builder, double seconds) : builder_(builder), seconds_(seconds) {}

  /// Adds an object; delays its start in steps of half a second until it meets no other object.
  void add(const std::string& class_name, const GroundPath& way, Drive driven) {
    SceneObject thing = builder_.draw(class_name);
    thing.moves = true;
    for (int attempt = 0; attempt < 60; ++attempt, driven.start_s += 0.5) {
      thing.motion = uprightMotion(way, driven, 0.5 * thing.size.z());
      limitPresence(thing);
      if (!meetsAnyone(thing)) {
        builder_.reserveWay(thing, seconds_, 0.3);
        const Trajectory motion = thing.motion;
        builder_.putMoving(std::move(thing), motion);
        return;
      }
    }
    check(false, "there is a time at which everyone can drive");
  }

 private:
  /// The object is present while it is on the street; it appears and disappears beyond the street's
  /// ends.
  void limitPresence(SceneObject& thing) const {
    const auto inside = [&](double t) {
      const Eigen::Vector3d p = thing.motion.poseAt(t).p;
      return p.x() > kNearEnd + 8.0 && p.x() < kFarEnd - 8.0 && std::abs(p.y()) < 48.0;
    };
    thing.present_from_s = -kForever;
    thing.present_until_s = kForever;
    double first = -5.0;
    while (first < seconds_ && !inside(first)) first += 0.05;
    if (first > -5.0) thing.present_from_s = first;
    double last = std::max(first, 0.0);
    while (last < seconds_ + 5.0 && inside(last)) last += 0.05;
    if (last < seconds_ + 5.0) thing.present_until_s = last;
  }

  bool meetsAnyone(const SceneObject& thing) const {
    for (double t = 0.0; t <= seconds_ + 1.0; t += 0.05) {
      if (!thing.presentAt(t)) continue;
      const Solid solid = solidOf(thing, t);
      SceneObject self;
      self.size = {4.4, 1.9, 1.6};
      self.motion = builder_.scene().body;
      if (meet(solidOf(self, t), solid, 0.6)) return true;
      for (const SceneObject& other : builder_.scene().objects) {
        if (other.presentAt(t) && meet(solidOf(other, t), solid, 0.4)) return true;
      }
    }
    return false;
  }

  SceneBuilder& builder_;
  double seconds_;
};

Drive startingAt(double start_s, Drive driven) {
  driven.start_s = start_s;
  return driven;
}

/// The first car leaves the left kerb for the oncoming lane, the second leaves the right kerb,
/// fifteen metres ahead of the body. The third arrives on the oncoming lane and parks.
void addParkingManoeuvres(Traffic& traffic, double seconds) {
  const SpeedLimits limits{7.0, 1.5, 1.5, 1.5};
  const double infinity = std::numeric_limits<double>::infinity();
  const GroundPath off(
      {{{84, kParked}}, {{76, kParked}, 14}, {{64, kLane}, 14}, {{kNearEnd, kLane}}}, false, 2.0);
  traffic.add("car", off, startingAt(0.0, drive(off, limits, 0.0, infinity, 4.5, seconds + 5.0)));
  const SpeedLimits hasty{8.5, 2.5, 1.5, 2.5};
  const GroundPath out(
      {{{205, -kParked}}, {{213, -kParked}, 14}, {{225, -kLane}, 14}, {{kFarEnd, -kLane}}}, false,
      2.0);
  traffic.add("car", out, drive(out, hasty, 0.0, infinity, 30.0, seconds + 5.0));
  const GroundPath in({{{300, kLane}}, {{192, kLane}, 14}, {{180, kParked}, 14}, {{172, kParked}}},
                      false, 2.0);
  traffic.add("car", in,
              startingAt(-4.0, drive(in, limits, 0.0, in.length() - 0.3, 0.0, seconds + 10.0)));
}

void addTraffic(SceneBuilder& builder, double seconds) {
  Dice& dice = builder.dice();
  Traffic traffic(builder, seconds);
  const double infinity = std::numeric_limits<double>::infinity();
  const GroundPath ahead({{{18, -kLane}}, {{kFarEnd, -kLane}}}, false);
  const SpeedLimits quick{dice.uniform(7.6, 8.2), 2.0, 1.5, 1.5};
  traffic.add("car", ahead, drive(ahead, quick, 0.0, infinity, 0.6, seconds + 5.0));
  addParkingManoeuvres(traffic, seconds);
  const GroundPath towards({{{kFarEnd, kLane}}, {{kNearEnd, kLane}}}, false);
  for (const double x : {120.0, 215.0, 310.0, 400.0}) {
    const double speed = dice.uniform(7.4, 8.2);
    traffic.add(dice.chance(0.25) ? "van" : "car", towards,
                cruise(kFarEnd - x - 6.0 * speed, speed, -6.0, seconds + 40.0));
  }
  const GroundPath across({{{kCrossing - kLane, 60}}, {{kCrossing - kLane, -60}}}, false);
  traffic.add("car", across, cruise(0.0, 8.0, 7.5, seconds + 40.0));
  for (const double side : {-1.0, 1.0}) {
    const double y = side * (0.5 * kRoadWidth + 1.9), x = dice.uniform(20.0, 60.0);
    const GroundPath pavement({{{x, y}}, {{x + 75.0, y}}}, false);
    traffic.add("person", pavement, cruise(0.0, dice.uniform(1.1, 1.4), -1.0, 50.0));
  }
}

}  // namespace

Scene makeTraffic(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("traffic", seed, options);
  const double seconds = builder.seconds(kTrafficSeconds);
  const double planned = std::max(seconds, kTrafficSeconds);
  const GroundPath way({{{0, -kLane}}, {{kFarEnd, -kLane}}}, false);
  const SpeedLimits limits{6.8, 2.0, 1.4, 1.4};
  // The drive stops before the end of the street, whatever the duration of the scene.
  const Drive driven = drive(way, limits, 0.0, 330.0, 1.2, planned + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  addTraffic(builder, planned);
  Furnishing furnishing;
  furnishing.ends = false;
  Streets(
      builder,
      {{{kNearEnd, 0}, {kFarEnd, 0}, kRoadWidth}, {{kCrossing, -50}, {kCrossing, 50}, kRoadWidth}},
      furnishing)
      .furnish();
  return builder.take();
}

}  // namespace perdure::sim

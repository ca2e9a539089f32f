// A camera that flies along a street and rolls from side to side, like a small aircraft.
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kRollSeconds = 30.0, kRollHeight = 1.8;
constexpr double kMostRoll = 60.0 * M_PI / 180.0, kRollPeriod = 9.0, kLevelUntil = 3.0;

Trajectory leaning(const GroundPath& way, const Drive& driven) {
  std::vector<RigidTransform> controls;
  for (std::size_t i = 0; i < driven.distance.size(); ++i) {
    const double t = driven.interval_s * static_cast<double>(i);
    const double since = std::max(0.0, t - kLevelUntil);
    const double grown = std::min(1.0, since / 3.0), wave = 2.0 * M_PI * since / kRollPeriod;
    const double roll = kMostRoll * grown * grown * (3.0 - 2.0 * grown) * std::sin(wave);
    const PathPoint p = way.at(driven.distance[i]);
    const double yaw = p.heading + 0.12 * grown * std::sin(0.5 * wave);
    const Eigen::Quaterniond q = expQuaternion({0, 0, yaw}) * expQuaternion({0, 0.06 * grown, 0}) *
                                 expQuaternion({roll, 0, 0});
    controls.emplace_back(
        q, Eigen::Vector3d(p.position.x(), p.position.y() + 0.4 * grown * std::sin(wave + 1.0),
                           kRollHeight + 0.15 * grown * std::sin(2.0 * wave)));
  }
  return Trajectory(driven.start_s, driven.interval_s, std::move(controls));
}

}  // namespace

Scene makeRoll(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("roll", seed, options);
  Dice& dice = builder.dice();
  const double seconds = builder.seconds(kRollSeconds);
  const GroundPath way({{{0, 0}}, {{200, 0}}}, false);
  const SpeedLimits limits{4.5, 2.0, 1.2, 1.2};
  const Drive driven = drive(way, limits, 0.0, 130.0, 1.5, seconds + 2.0);
  builder.setBody(leaning(way, driven), seconds, 1.0, 2.6);
  builder.scene().rig = makeRig(Carrier::kHand, options, dice, 0.0);
  drawDaylight(builder);
  Furnishing furnishing;
  furnishing.free_share = 0.35;
  Streets(builder, {{{-20.0, 0.0}, {165.0, 0.0}, kRoadWidth}}, furnishing).furnish();
  return builder.take();
}

}  // namespace perdure::sim

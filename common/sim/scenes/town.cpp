// A grid of streets, four kilometres in total, and a drive through nearly all of them.
#include <algorithm>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kTownSeconds = 520.0;
constexpr int kColumns = 6, kRows = 5;
constexpr std::size_t kVehicles = 500;

/// The crossings at which the drive turns: first along the rows, then along the columns.
std::vector<Eigen::Vector2d> turns() {
  std::vector<Eigen::Vector2i> crossings;
  const int right = kColumns - 1, top = kRows - 1;
  for (int row = 0; row < kRows; ++row) {
    const bool forth = row % 2 == 0;
    crossings.emplace_back(forth ? 0 : right, row);
    crossings.emplace_back(forth ? right : 0, row);
  }
  // With an odd number of rows the drive ends at the top right corner.
  for (int i = 0; i < kColumns; ++i) {
    const int column = right - i;
    crossings.emplace_back(column, i % 2 == 0 ? top : 0);
    crossings.emplace_back(column, i % 2 == 0 ? 0 : top);
  }
  std::vector<Eigen::Vector2d> points;
  for (const auto& crossing : crossings) {
    const Eigen::Vector2d point(kGridX * crossing.x(), kGridY * crossing.y());
    if (points.empty() || (point - points.back()).norm() > 1.0) points.push_back(point);
  }
  return points;
}

void thinOut(SceneBuilder& builder) {
  auto& objects = builder.scene().objects;
  const auto isVehicle = [](const SceneObject& o) {
    return o.class_name == "car" || o.class_name == "van";
  };
  auto count = static_cast<std::size_t>(std::ranges::count_if(objects, isVehicle));
  while (count > kVehicles) {
    const std::size_t i = builder.dice().below(objects.size());
    if (!isVehicle(objects[i])) continue;
    objects.erase(objects.begin() + static_cast<std::ptrdiff_t>(i));
    --count;
  }
}

}  // namespace

Scene makeTown(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("town", seed, options);
  const double seconds = builder.seconds(kTownSeconds);
  const GroundPath way = laneThrough(turns());
  const SpeedLimits limits{10.5, 2.4, 1.7, 1.9};
  const Drive driven = drive(way, limits, 8.0, way.length() - 8.0, 1.2, seconds + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  Streets(builder, gridOfRoads(kColumns, kRows), furnishingOfGrid()).furnish();
  thinOut(builder);
  return builder.take();
}

}  // namespace perdure::sim

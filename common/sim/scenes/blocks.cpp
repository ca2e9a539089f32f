// A town of equal blocks, and a drive that passes many of them before it returns.
#include <algorithm>
#include <utility>
#include <vector>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/block.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kBlocksSeconds = 400.0;
constexpr double kPitchX = 52.0, kPitchY = 46.0;  ///< distance between roads
/// Crossings at which the drive may turn. A further row of blocks surrounds them.
constexpr int kCrossingsX = 7, kCrossingsY = 6;
constexpr std::size_t kBlocks = (kCrossingsX + 1) * (kCrossingsY + 1);
constexpr std::size_t kUnmistakable = 8, kWithFewChanges = 28;

Eigen::Vector2d crossing(int column, int row) { return {kPitchX * column, kPitchY * row}; }

std::vector<Road> roadsOfBlocks() {
  std::vector<Road> roads;
  for (int row = -1; row <= kCrossingsY; ++row)
    roads.push_back({crossing(-1, row), crossing(kCrossingsX, row), kRoadWidth});
  for (int column = -1; column <= kCrossingsX; ++column)
    roads.push_back({crossing(column, -1), crossing(column, kCrossingsY), kRoadWidth});
  return roads;
}

/// The route follows three rows, crosses them along three columns, and returns to the start. It
/// then repeats the first row, and drives the last one in the opposite direction. Columns and first
/// corner are random.
std::vector<Eigen::Vector2d> turnsAmongBlocks(Dice& dice) {
  const int right = kCrossingsX - 1, top = kCrossingsY - 1;
  const int third = 4 + static_cast<int>(dice.below(2)),
            second = 1 + static_cast<int>(dice.below(3));
  const bool mirror_x = dice.chance(0.5), mirror_y = dice.chance(0.5);
  std::vector<Eigen::Vector2d> points;
  for (const auto& [column, row] : std::vector<std::pair<int, int>>{{0, 0},
                                                                    {right, 0},
                                                                    {right, 2},
                                                                    {0, 2},
                                                                    {0, 4},
                                                                    {right, 4},
                                                                    {right, top},
                                                                    {third, top},
                                                                    {third, 0},
                                                                    {second, 0},
                                                                    {second, top},
                                                                    {0, top},
                                                                    {0, 0},
                                                                    {right, 0},
                                                                    {right, 4},
                                                                    {0, 4}}) {
    points.push_back(crossing(mirror_x ? right - column : column, mirror_y ? top - row : row));
  }
  return points;
}

/// The number of objects in each block that differ from the template of all blocks.
std::vector<std::size_t> changesOf(Dice& dice) {
  std::vector<std::size_t> changes(kBlocks, 0);
  for (std::size_t i = 0; i < kBlocks; ++i) {
    if (i < kUnmistakable)
      changes[i] = 7 + dice.below(4);
    else if (i < kUnmistakable + kWithFewChanges)
      changes[i] = 1 + dice.below(2);
  }
  for (std::size_t i = kBlocks; i > 1; --i) std::swap(changes[i - 1], changes[dice.below(i)]);
  return changes;
}

/// Places a house at the end of each road, facing the road.
void closeRoads(const std::vector<Road>& roads, SceneBuilder& builder) {
  constexpr double kDepth = 7.0, kFromEnd = 0.5 * kRoadWidth + 3.3 + 0.5 * kDepth;
  for (const Road& road : roads) {
    const Eigen::Vector2d way = (road.to - road.from).normalized();
    const double heading = std::atan2(way.y(), way.x());
    for (const bool at_end : {false, true}) {
      const Eigen::Vector3d size(kRoadWidth + 6.0, kDepth, builder.dice().uniform(6.0, 12.0));
      builder.mustPut(PropKind::kFacade, size,
                      {at_end ? Eigen::Vector2d(road.to + kFromEnd * way)
                              : Eigen::Vector2d(road.from - kFromEnd * way),
                       heading + (at_end ? -M_PI_2 : M_PI_2), 0.0});
    }
  }
}

void putBlocks(SceneBuilder& builder) {
  const Eigen::Vector2d half(0.5 * (kPitchX - kRoadWidth), 0.5 * (kPitchY - kRoadWidth));
  const Block original(half, builder);
  const auto changes = changesOf(builder.dice());
  for (std::size_t i = 0; i < kBlocks; ++i) {
    const auto column = static_cast<int>(i % (kCrossingsX + 1)) - 1;
    const auto row = static_cast<int>(i / (kCrossingsX + 1)) - 1;
    Block block = original;
    block.alter(changes[i], builder);
    block.putAt(0.5 * (crossing(column, row) + crossing(column + 1, row + 1)), builder);
  }
}

}  // namespace

Scene makeBlocks(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("blocks", seed, options);
  const double seconds = builder.seconds(kBlocksSeconds);
  const GroundPath way = laneThrough(turnsAmongBlocks(builder.dice()));
  const SpeedLimits limits{10.5, 2.4, 1.7, 1.9};
  const Drive driven = drive(way, limits, 8.0, way.length() - 8.0, 1.2, seconds + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  const std::vector<Road> roads = roadsOfBlocks();
  builder.scene().ground = GroundKind::kStreet;
  builder.scene().roads = roads;
  putBlocks(builder);
  closeRoads(roads, builder);
  return builder.take();
}

}  // namespace perdure::sim

// The filter in worlds that are as it is told (world.h), and whether its beliefs are true there.
#pragma once

#include "tests/scenario/beliefs/world.h"
#include "tools/evaluate/consistency_score.h"
#include "tools/evaluate/reliability.h"

namespace perdure::test {

/// What one object is off by, and by what it said.
struct Outlier {
  std::uint64_t world = 0;  ///< seed
  ObjectId id = 0;
  std::string class_name;
  double position = 0.0, half_yaw = 0.0, size = 0.0;    ///< squared, normalised: of 3, 1, 3 numbers
  double apart_m = 0.0, turned = 0.0, sigma_yaw = 0.0;  ///< metres, radians
  Eigen::Vector3d true_size = Eigen::Vector3d::Zero(), believed_size = Eigen::Vector3d::Zero();
  std::uint32_t hits = 0, misses = 0;
};

/// Scores of one world, or of all.
struct BeliefScores {
  /// Standing things that are confirmed at the end, of the right class, visible in 20 frames.
  tools::RunAnees position{"position", 3, {}}, half_yaw{"yaw mod 180 deg", 1, {}},
      size{"log size", 3, {}};
  /// The same, each object for itself.
  tools::Anees all_position{"position", 3, {}}, all_half_yaw{"yaw mod 180 deg", 1, {}},
      all_size{"log size", 3, {}};
  /// Of each object one look at its belief, at an age that is drawn when it is initiated: later
  /// things must not choose the moment, or those that live short are asked when they were young.
  tools::Reliability existence{"existence", {}};
  tools::ClassReliability classes{"classes", {}};
  std::size_t things = 0, seen_things = 0, objects = 0, wrong_class = 0;
  std::vector<Outlier> outliers;  ///< of those of the right class, beyond kOutlier in any
  std::size_t new_boxes = 0, false_boxes = 0;  ///< of things that no object is yet; of nothing

  void add(const BeliefScores& world);
};

/// Runs the filter through one world.
BeliefScores runWorld(const WorldOptions& options, const Told& told);
/// Over `runs` seeds from options.seed on.
BeliefScores runWorlds(WorldOptions options, const Told& told, std::size_t runs);

void print(const BeliefScores& scores);
/// One line for each, those first that are farthest out.
void print(std::vector<Outlier> outliers);

}  // namespace perdure::test

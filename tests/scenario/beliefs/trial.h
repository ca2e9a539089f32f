// Runs the filter in worlds that match its model (world.h), and scores the calibration of its
// beliefs.
#pragma once

#include "tests/scenario/beliefs/world.h"
#include "tools/evaluate/consistency_score.h"
#include "tools/evaluate/reliability.h"

namespace perdure::test {

/// The errors of one object, with its stated uncertainty.
struct Outlier {
  std::uint64_t world = 0;  ///< seed
  ObjectId id = 0;
  std::string class_name;
  double position = 0.0, half_yaw = 0.0, size = 0.0;    ///< squared normalised errors of 3, 1 and 3
                                                        ///< components
  double apart_m = 0.0, turned = 0.0, sigma_yaw = 0.0;  ///< metres, radians
  Eigen::Vector3d true_size = Eigen::Vector3d::Zero(), believed_size = Eigen::Vector3d::Zero();
  std::uint32_t hits = 0, misses = 0;
};

/// Scores of one world, or of all.
struct BeliefScores {
  /// Errors by world, over standing objects of the right class, visible in 20 frames and confirmed
  /// at the end.
  tools::RunAnees position{"position", 3, {}}, half_yaw{"yaw mod 180 deg", 1, {}},
      size{"log size", 3, {}};
  /// The errors of single objects.
  tools::Anees all_position{"position", 3, {}}, all_half_yaw{"yaw mod 180 deg", 1, {}},
      all_size{"log size", 3, {}};
  /// One sample of each object's belief, at an age drawn at its initiation. Later events must not
  /// choose the time; otherwise objects with short tracks would be sampled only at young ages.
  tools::Reliability existence{"existence", {}};
  tools::ClassReliability classes{"classes", {}};
  std::size_t things = 0, seen_things = 0, objects = 0, wrong_class = 0;
  std::vector<Outlier> outliers;  ///< objects of the right class with an error beyond kOutlier
  std::size_t new_boxes = 0, false_boxes = 0;  ///< boxes of true objects without a track; false
                                               ///< boxes

  void add(const BeliefScores& world);
};

/// Runs the filter through one world.
BeliefScores runWorld(const WorldOptions& options, const Told& told);
/// Runs `runs` worlds, with seeds from options.seed on.
BeliefScores runWorlds(WorldOptions options, const Told& told, std::size_t runs);

void print(const BeliefScores& scores);
/// Prints one line for each outlier, largest errors first.
void print(std::vector<Outlier> outliers);

}  // namespace perdure::test

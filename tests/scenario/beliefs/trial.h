// The filter in worlds that are as it is told (world.h), and whether its beliefs are true there.
#pragma once

#include "tests/scenario/beliefs/world.h"
#include "tools/evaluate/consistency_score.h"
#include "tools/evaluate/reliability.h"

namespace perdure::test {

/// Scores of one world, or of all.
struct BeliefScores {
  /// Standing things that are confirmed at the end, of the right class, visible in 20 frames.
  tools::RunAnees position{"position", 3, {}}, half_yaw{"yaw mod 180 deg", 1, {}},
      size{"log size", 3, {}};
  /// The same, each object for itself.
  tools::Anees all_position{"position", 3, {}}, all_half_yaw{"yaw mod 180 deg", 1, {}},
      all_size{"log size", 3, {}};
  /// Of each object one look at its belief, at an age that is drawn when it is born: later things
  /// must not choose the moment, or those that live short are asked when they were young.
  tools::Reliability existence{"existence", {}};
  tools::ClassReliability classes{"classes", {}};
  std::size_t things = 0, seen_things = 0, objects = 0, wrong_class = 0;
  std::size_t new_boxes = 0, false_boxes = 0;  ///< of things that no object is yet; of nothing

  void add(const BeliefScores& world);
};

/// Runs the filter through one world.
BeliefScores runWorld(const WorldOptions& options, const Told& told);
/// Over `runs` seeds from options.seed on.
BeliefScores runWorlds(WorldOptions options, const Told& told, std::size_t runs);

void print(const BeliefScores& scores);

}  // namespace perdure::test

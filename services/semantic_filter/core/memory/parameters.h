// Parameters of the archive and of map alignment.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct MemoryParameters {
  bool archive = true;
  double recall_m = 60.0;  ///< objects of the map that are nearer to the body are recalled
  double margin_m = 20.0;  ///< tracks that are farther than both together are archived
  double after_s = 5.0;    ///< once they were not detected for this time
};

/// Of a map in another frame of reference.
struct AlignmentParameters {
  double nats = 25.0;         ///< least log-likelihood ratio against chance
  double margin_nats = 10.0;  ///< and above the best other alignment
  std::int64_t pairs = 4;     ///< objects that are surely in both, at least
  double known_share = 0.7;   ///< share of what is visible that is on the map
};

}  // namespace perdure::semantic_filter

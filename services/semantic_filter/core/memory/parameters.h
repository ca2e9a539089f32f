// Parameters of the archive.
#pragma once

namespace perdure::semantic_filter {

struct MemoryParameters {
  bool archive = true;
  double recall_m = 60.0;  ///< objects of the map that are nearer to the body are recalled
  double margin_m = 20.0;  ///< tracks that are farther than both together are archived
  double after_s = 5.0;    ///< and that were not detected for this time
};

}  // namespace perdure::semantic_filter

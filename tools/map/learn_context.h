// What stands near what, counted in maps: the matrix of the filter's context.
#pragma once

#include <cstddef>
#include <vector>

#include "services/map_store/core/map_database.h"
#include "services/semantic_filter/core/belief/class_prior.h"

namespace perdure::tools {

struct LearnOptions {
  double radius_m = 10.0;  ///< pairs further apart are not near
  double smoothing = 5.0;  ///< pairs as chance would have them, added to each count
};

struct LearntContext {
  semantic_filter::ContextMatrix matrix;  ///< empty where there is no pair at all
  std::size_t objects = 0;                ///< that stand still
  std::size_t pairs = 0;                  ///< within the radius
};

/// Counts pairs of one frame of reference by their probabilities, r_i r_j π_ia π_jb, as they were
/// without context, so that a map that was made with one teaches nothing of it; things of no known
/// class and what moves do not count. With n_a the pairs that a is in, N all of them and s the
/// smoothing: log_ratio = log((n_ab + s) / (n_a n_b / N + s)).
LearntContext learnContext(std::vector<map_store::PlacedBelief> beliefs,
                           const LearnOptions& options);

}  // namespace perdure::tools

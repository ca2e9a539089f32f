// Parameters of the batch estimate.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

inline constexpr int kMostKeyframes = 32;  ///< keyframes of a track, whatever is configured

struct SmoothingParameters {
  std::int64_t keyframes = 24;  ///< kept for one track at most; 0: no batch estimate
  std::int64_t least = 5;       ///< with fewer the EKF's state stays
  double fresh = 0.3;           ///< share of new keyframes that calls for another fit
  std::int64_t per_frame = 2;   ///< tracks that are fitted in one frame
  std::int64_t patience = 3;   ///< fits become at most so many times rarer where they change little
  double new_view = 0.12;      ///< least view change between keyframes, in bias lengths
  double place = 0.2;          ///< a fit that is placed worse, relative to the distance, is refused
  double contradicted = 0.2;   ///< share of keyframes that may contradict a fit
  double least_weight = 0.02;  ///< of a hypothesis that is fitted
};

}  // namespace perdure::semantic_filter

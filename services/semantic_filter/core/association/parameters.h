// Parameters of correlated observations.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct TemperingParameters {
  double correlation = 0.5;  ///< of the errors of two observations from the same viewpoint
  /// View change after which it has fallen to 1/e.
  double angle = 0.1;                 ///< direction to the object, rad
  double log_distance = 0.1;          ///< logarithm of the distance
  double image_angle = 0.03;          ///< place in the image, rad
  double detection_rate_prior = 3.0;  ///< weight of the class's P_D, in observations
};

}  // namespace perdure::semantic_filter

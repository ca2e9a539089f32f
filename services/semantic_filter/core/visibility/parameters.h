// Parameters of occlusion and detectability.
#pragma once

#include <cstdint>

namespace perdure::semantic_filter {

struct VisibilityParameters {
  std::int64_t cell_px = 8;           ///< of the depth buffer
  double minimum = 0.25;              ///< a smaller visible fraction counts as 0: no evidence
  double full = 0.7;                  ///< from here on an object is reported as visible
  double solid = 0.4;                 ///< existence from which an object occludes others
  double unmapped_occluder = 0.2;     ///< its probability in a view that is new
  double hard_to_detect = 0.05;       ///< the same of a view from which detections are rare
  double hard_detection_share = 0.3;  ///< P_D there, relative
  /// View change after which both have fallen to 1/e of what was learned.
  double detectability_angle = 0.15;        ///< direction to the object, rad
  double detectability_log_distance = 0.3;  ///< logarithm of the distance
};

}  // namespace perdure::semantic_filter

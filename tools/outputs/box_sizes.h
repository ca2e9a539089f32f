// Checks whether objects have the sizes of their classes. Their distances come from the motion of
// the boxes' centres, so that boxes of a wrong size give objects of a wrong size.
#pragma once

#include <optional>
#include <vector>

#include "tools/outputs/run_doubts.h"

namespace perdure::tools {

struct EstimatedHeight {
  double excess = 0.0;  ///< logarithm of the estimated height minus the mean of its class
  double sigma = 0.0;   ///< standard deviation of the estimate
  double spread = 0.0;  ///< standard deviation of the class
};

/// A doubt if the mean excess of at least ten objects is significant.
std::optional<Doubt> doubtOfHeights(const std::vector<EstimatedHeight>& objects);

}  // namespace perdure::tools

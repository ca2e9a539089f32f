// Instance ids of the nodes in a pipeline run. They are fixed, so that repeated runs give the same
// outputs. Further runs on a stored map have other ids (Pipeline::instanceOf).
#pragma once

#include "common/base/ids.h"

namespace perdure::tools {

inline constexpr InstanceId kCapture = 1, kVio = 2, kInference = 3, kFilter = 4, kMapStore = 5;
inline constexpr InstanceId kInstancesOfARun = 16;

}  // namespace perdure::tools

// Who speaks in a run of the pipeline. Fixed, so that nothing in the outputs depends on the run;
// another run on the same map has others (Pipeline::instanceOf).
#pragma once

#include "common/base/ids.h"

namespace perdure::tools {

inline constexpr InstanceId kCapture = 1, kVio = 2, kInference = 3, kFilter = 4, kMapStore = 5;
inline constexpr InstanceId kInstancesOfARun = 16;

}  // namespace perdure::tools

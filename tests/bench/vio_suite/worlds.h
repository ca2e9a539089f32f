// The simulated clips' scenes: places of the simulator, with motions and sensors of their own.
#pragma once

#include "common/sim/scene.h"

namespace perdure::bench {

sim::Scene roomWalk(const sim::SceneOptions& options);
sim::Scene roomFly(const sim::SceneOptions& options);
sim::Scene hallFly(const sim::SceneOptions& options);
sim::Scene hallEven(const sim::SceneOptions& options);
sim::Scene shaky(const sim::SceneOptions& options);
sim::Scene dim(const sim::SceneOptions& options);
sim::Scene plain(const sim::SceneOptions& options);
sim::Scene street(const sim::SceneOptions& options);
sim::Scene far(const sim::SceneOptions& options);
sim::Scene coarseImu(const sim::SceneOptions& options);
sim::Scene fineImu(const sim::SceneOptions& options);
sim::Scene rolling(const sim::SceneOptions& options);

}  // namespace perdure::bench

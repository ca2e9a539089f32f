// The scenes of the simulated clips: places of the simulator with motions and sensors of their own.
// `draw` keeps the motion and changes textures, noise and sensor errors.
#pragma once

#include "common/sim/scene.h"

namespace perdure::bench {

sim::Scene roomWalk(const sim::SceneOptions& options, unsigned draw);
sim::Scene roomFly(const sim::SceneOptions& options, unsigned draw);
sim::Scene hallFly(const sim::SceneOptions& options, unsigned draw);
sim::Scene hallEven(const sim::SceneOptions& options, unsigned draw);
sim::Scene shaky(const sim::SceneOptions& options, unsigned draw);
sim::Scene turn(const sim::SceneOptions& options, unsigned draw);
sim::Scene pan(const sim::SceneOptions& options, unsigned draw);
sim::Scene dim(const sim::SceneOptions& options, unsigned draw);
sim::Scene plain(const sim::SceneOptions& options, unsigned draw);
sim::Scene street(const sim::SceneOptions& options, unsigned draw);
sim::Scene far(const sim::SceneOptions& options, unsigned draw);
sim::Scene coarseImu(const sim::SceneOptions& options, unsigned draw);
sim::Scene fineImu(const sim::SceneOptions& options, unsigned draw);
sim::Scene rolling(const sim::SceneOptions& options, unsigned draw);

}  // namespace perdure::bench

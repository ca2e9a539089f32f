#include "common/sim/speed.h"

#include "common/base/check.h"
#include "common/sim/dice.h"

namespace perdure::sim {

std::vector<SpeedSample> simulateSpeed(const Trajectory& body, const SpeedErrors& errors,
                                       std::uint64_t seed, double seconds, TimePoint epoch) {
  check(errors.rate_hz > 0.0 && errors.sigma > 0.0, "a speed has a rate and a deviation");
  Dice dice(seedOf("speed", {seed}));
  std::vector<SpeedSample> samples;
  for (std::uint64_t i = 0;; ++i) {
    const Duration since = durationFromSeconds(static_cast<double>(i) / errors.rate_hz);
    if (since > durationFromSeconds(seconds)) return samples;
    const MotionState state = body.at(toSeconds(since));
    const double along = state.velocity_W.dot(state.T_WB.q * Eigen::Vector3d::UnitX());
    const double noise = dice.normal() * (errors.noise ? errors.sigma : 0.0);
    samples.push_back({0, i, epoch + since, errors.scale * along + noise, errors.sigma});
  }
}

}  // namespace perdure::sim

// Updates without images: speed along the body's x axis, planar motion, and rest.
#pragma once

#include "common/base/result.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// Velocity in the body frame and its derivative by [θ, v].
Eigen::Vector3d bodyVelocity(const Nav& nav, Eigen::Matrix<double, 3, 6>* J = nullptr);

/// Speed along body x (m/s, σ > 0). With options.planar, lateral and vertical velocity are also
/// constrained to about zero. Fails with "speed_gated".
Result<void> updateSpeed(State& state, double speed, double sigma, const SpeedOptions& options);

/// Mean inertial readings over an interval at rest, with their standard deviations.
struct RestSample {
  Eigen::Vector3d rate, force;     ///< means of gyro and accelerometer, with bias
  double rate_sigma, force_sigma;  ///< standard deviations of the means, rad/s and m/s²
};
RestSample restSample(const std::vector<ImuReading>& readings, const ImuNoise& noise);

/// Predicted [rate, force] at rest and its derivative by [θ, b_g, b_a] (6×9).
Eigen::Matrix<double, 6, 1> restPrediction(const Nav& nav, double gravity,
                                           Eigen::Matrix<double, 6, 9>* J = nullptr);

/// Sets velocity and rotation rate to zero, the force to gravity. Fails with "rest_gated".
Result<void> updateRest(State& state, const RestSample& sample, const RestOptions& options,
                        double gravity, bool gated = true);

/// Constrains the pose of clone `frame` to that of clone `before`, within the options' deviations.
Result<void> updateNoMotion(State& state, std::uint64_t before, std::uint64_t frame,
                            const RestOptions& options);

}  // namespace perdure::vio

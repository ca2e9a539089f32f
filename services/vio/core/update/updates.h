// Updates without images: speed along the body's x axis, planar motion, and rest.
#pragma once

#include "common/base/result.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// Returns the velocity in the body frame, and its derivative by [θ, v] in `J`.
Eigen::Vector3d bodyVelocity(const Nav& nav, Eigen::Matrix<double, 3, 6>* J = nullptr);

/// Updates with the speed along body x, in m/s; `sigma` must be positive. With options.planar,
/// lateral and vertical velocity are also constrained to about zero. Fails with "speed_gated", or
/// as State::update() does.
Result<void> updateSpeed(State& state, double speed, double sigma, const SpeedOptions& options);

/// Mean inertial readings over an interval at rest, with their standard deviations.
struct RestSample {
  Eigen::Vector3d rate, force;     ///< means of gyro and accelerometer, with bias
  double rate_sigma, force_sigma;  ///< standard deviations of the means, rad/s and m/s²
};
RestSample restSample(const std::vector<ImuReading>& readings, const ImuNoise& noise);

/// Returns the predicted [rate, force] at rest, and its derivative by [θ, b_g, b_a] in `J`.
Eigen::Matrix<double, 6, 1> restPrediction(const Nav& nav, double gravity,
                                           Eigen::Matrix<double, 6, 9>* J = nullptr);

/// Constrains velocity and rotation rate to zero, and the force to gravity. If `gated`, fails with
/// "rest_gated" for contradicting samples.
Result<void> updateRest(State& state, const RestSample& sample, const RestOptions& options,
                        double gravity, bool gated = true);

/// Constrains the pose of clone `frame` to that of clone `before`, with the deviations of
/// `options`.
Result<void> updateNoMotion(State& state, std::uint64_t before, std::uint64_t frame,
                            const RestOptions& options);

}  // namespace perdure::vio

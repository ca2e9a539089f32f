// Updates that are not vision: speed along the body's x axis, planar motion, and standing still.
#pragma once

#include "common/base/result.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// The velocity in the body frame and its derivative by [θ, v].
Eigen::Vector3d bodyVelocity(const Nav& nav, Eigen::Matrix<double, 3, 6>* J = nullptr);

/// Speed along body x (m/s, σ > 0); with options.planar also no lateral and vertical velocity.
/// Fails with "speed_gated".
Result<void> updateSpeed(State& state, double speed, double sigma, const SpeedOptions& options);

/// What the inertial samples of an interval at rest say, as means, with the deviation of samples.
struct RestSample {
  Eigen::Vector3d rate, force;     ///< means of gyro and accelerometer, with bias
  double rate_sigma, force_sigma;  ///< of the means, rad/s and m/s²
};
RestSample restSample(const std::vector<ImuReading>& readings, const ImuNoise& noise);

/// Predicted [rate, force] at rest and its derivative by [θ, b_g, b_a] (6×9).
Eigen::Matrix<double, 6, 1> restPrediction(const Nav& nav, double gravity,
                                           Eigen::Matrix<double, 6, 9>* J = nullptr);

/// No velocity, no rotation, force against gravity only. Fails with "rest_gated".
Result<void> updateRest(State& state, const RestSample& sample, const RestOptions& options,
                        double gravity, bool gated = true);

/// The pose of clone `frame` equals that of clone `before`, to the options' deviations.
Result<void> updateNoMotion(State& state, std::uint64_t before, std::uint64_t frame,
                            const RestOptions& options);

}  // namespace perdure::vio

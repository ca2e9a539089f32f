// Inertial propagation of the state between two images. Runge-Kutta 4 integrates the increment,
// expressed in the body frame at the start of the interval, with the exact derivative of each step
// (Forster et al., TRO 2017). Samples are interpolated linearly. The transition is then evaluated
// at first estimates (Li & Mourikis, IJRR 2013; Huang et al., IJRR 2010).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

using Matrix15d = Eigen::Matrix<double, 15, 15>;
using Matrix93d = Eigen::Matrix<double, 9, 3>;

/// Increment from body frame B0 to B1. It does not contain gravity and the initial velocity.
struct ImuIncrement {
  double dt = 0.0;                                                             ///< s
  Eigen::Quaterniond dq = Eigen::Quaterniond::Identity();                      ///< R_B0_B1
  Eigen::Vector3d dv = Eigen::Vector3d::Zero(), dp = Eigen::Vector3d::Zero();  ///< in B0
  Matrix15d F = Matrix15d::Identity();     ///< d [θ, dp, dv, bg, ba] at the end / at the start
  Matrix15d Q = Matrix15d::Zero();         ///< noise of [θ, dp, dv, bg, ba]
  Matrix93d by_scale = Matrix93d::Zero();  ///< d [θ, dp, dv] at the end / d gyroscope scale
  Eigen::Vector3d end_rate = Eigen::Vector3d::Zero();    ///< w_WB_B at the end, corrected
  Eigen::Vector3d mean_rate = Eigen::Vector3d::Zero();   ///< bias and scale removed
  Eigen::Vector3d mean_force = Eigen::Vector3d::Zero();  ///< bias removed, in B
};

/// Integrates at least two readings of ImuBuffer::between(). The rate is (reading − bias) / scale.
ImuIncrement integrate(const std::vector<ImuReading>& readings, const Eigen::Vector3d& gyro_bias,
                       const Eigen::Vector3d& accel_bias, const ImuNoise& noise,
                       const Eigen::Vector3d& gyro_scale = Eigen::Vector3d::Ones());

/// Computes only the rotation of integrate(): R_B0_B1.
Eigen::Quaterniond integrateRotation(const std::vector<ImuReading>& readings,
                                     const Eigen::Vector3d& gyro_bias,
                                     const Eigen::Vector3d& gyro_scale = Eigen::Vector3d::Ones());

/// Returns the motion of the body from `half` before `time` to `half` after it; `nav` is the state
/// at `time`. Before the first and after the last sample, that sample is used. `readings` is reused
/// as memory.
RowMotion rowMotion(const Nav& nav, const ImuBuffer& imu, TimePoint time, Duration half,
                    double gravity, std::vector<ImuReading>& readings,
                    const Eigen::Vector3d& gyro_scale = Eigen::Vector3d::Ones());

/// Returns the navigation state after the increment; `gravity` in m/s², along −z of W.
Nav predict(const Nav& nav, const ImuIncrement& increment, double gravity);

/// Returns the transition of the navigation error [θ, p, v, b_g, b_a] from `from` to `to` in W.
/// Linearises at the rotation, position and velocity of `from`.
Matrix15d transition(const Nav& from, const Nav& to, const ImuIncrement& increment,
                     const Eigen::Matrix3d& R_W_B0, double gravity);

/// Propagates state and covariance over the increment; `to` is the new time, IMU clock.
void propagate(State& state, const ImuIncrement& increment, TimePoint to, double gravity,
               bool first_estimates);

}  // namespace perdure::vio

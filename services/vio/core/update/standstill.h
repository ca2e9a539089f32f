// Whether the body stands still in traffic: an IMU only confirms that it has not moved (Skog,
// Händel, Nilsson, Rantakokko, IEEE TBME 2010). Derivation: tools/docs/maths/vio-rest-and-speed.md.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/time.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// Expected IMU values of a body at rest, bias included.
struct RestExpectation {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();   ///< rad/s, in B
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< m/s², in B
  double rate_sigma = 0.0, force_sigma = 0.0;       ///< standard deviations of one axis
};

/// Computes the expectation from the filter's attitude and biases, with their covariance.
RestExpectation restExpectation(const State& state, double gravity);

/// Whether the means over `window` before `now` agree with the expectation, taken `age` ago. False
/// if the samples do not cover the window.
bool imuRests(const ImuBuffer& imu, TimePoint now, Duration window, const RestExpectation& expected,
              Duration age, const ImuNoise& noise);

/// Whether rate and force were constant over `window` before `now`; false without its samples.
bool imuIsEven(const ImuBuffer& imu, TimePoint now, Duration window, const ImuNoise& noise);

/// Stores when the body last stood still, and the IMU values expected at rest.
class Standstill {
 public:
  /// Clears the memory, at a start or after motion.
  void forget() { confirmed_.reset(); }
  bool known() const { return confirmed_.has_value(); }
  /// The images show that the body stands still at `now`.
  void confirm(TimePoint now, const RestExpectation& expected);
  /// Whether the IMU shows that a body that stood still has not moved since. A disturbance of up to
  /// a second without net velocity change only interrupts the standstill.
  bool holds(const ImuBuffer& imu, TimePoint now, const ImuNoise& noise);

 private:
  std::optional<TimePoint> confirmed_;    ///< when the images last confirmed the standstill
  std::optional<TimePoint> interrupted_;  ///< time since which the IMU contradicts the rest
  TimePoint begun_;                       ///< time at which the images first confirmed the rest
  /// Expectation with its time, older than a slow acceleration, which the filter takes for a bias.
  struct Reference {
    TimePoint time;
    RestExpectation expected;
  };
  Reference reference_, next_;
};

}  // namespace perdure::vio

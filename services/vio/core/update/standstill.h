// Decides whether the body stands still in traffic. The IMU alone cannot detect rest; it only
// confirms that a body at rest has not moved since (Skog, Händel, Nilsson, Rantakokko, IEEE TBME
// 2010). Derivation: tools/docs/maths/vio-rest-and-speed.md.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/time.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// Expected IMU readings of a body at rest, with bias.
struct RestExpectation {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();   ///< rad/s, in B
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< m/s², in B
  double rate_sigma = 0.0, force_sigma = 0.0;       ///< deviation of one axis, same units
};

/// Computes the expectation from the filter's attitude and biases, with their covariance.
RestExpectation restExpectation(const State& state, double gravity);

/// Returns true if the mean readings over `window` before `now` agree with the expectation, which
/// was computed `age` ago. Returns false if the samples do not cover the window.
bool imuRests(const ImuBuffer& imu, TimePoint now, Duration window, const RestExpectation& expected,
              Duration age, const ImuNoise& noise);

/// Returns true if rate and force were constant over `window` before `now`; false if the samples do
/// not cover the window.
bool imuIsEven(const ImuBuffer& imu, TimePoint now, Duration window, const ImuNoise& noise);

/// Stores when the body last stood still, and the IMU readings expected at rest.
class Standstill {
 public:
  /// Forgets the standstill. Call it at a start and after motion.
  void forget() { confirmed_.reset(); }
  bool known() const { return confirmed_.has_value(); }
  /// Reports that the images show the body at rest at `now`.
  void confirm(TimePoint now, const RestExpectation& expected);
  /// Returns true if the body stood still and, by the IMU, has not moved since. During a
  /// disturbance it returns false; if the disturbance lasts longer than a second, the standstill is
  /// forgotten.
  bool holds(const ImuBuffer& imu, TimePoint now, const ImuNoise& noise);

 private:
  std::optional<TimePoint> confirmed_;    ///< time at which the images last showed rest
  std::optional<TimePoint> interrupted_;  ///< time since which the IMU contradicts rest
  TimePoint begun_;                       ///< time at which the images first showed this rest
  /// Expectation and its time. `reference_` is at least two seconds old, because the filter takes a
  /// slow acceleration for a bias.
  struct Reference {
    TimePoint time;
    RestExpectation expected;
  };
  Reference reference_, next_;
};

}  // namespace perdure::vio

// Whether the body stands, where most of the picture moves: traffic before a body at rest looks
// like motion. An IMU alone cannot tell rest from an even drive, so it never says by itself that
// the body stands; it says whether a body that stood stands still. Detectors of zero velocity:
// Skog, Händel, Nilsson, Rantakokko, IEEE TBME 2010. tools/docs/maths/vio-rest-and-speed.md
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/time.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// What the IMU says of a body at rest, bias included.
struct RestExpectation {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();   ///< rad/s, in B
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< m/s², in B
  double rate_sigma = 0.0, force_sigma = 0.0;       ///< of an axis
};

/// By the filter's attitude and biases, with their covariance.
RestExpectation restExpectation(const State& state, double gravity);

/// Whether the means over `window` before `now` agree with the expectation. `age`: time since it
/// was right, in which the biases walked. False where the samples do not reach back so far.
bool imuRests(const ImuBuffer& imu, TimePoint now, Duration window, const RestExpectation& expected,
              Duration age, const ImuNoise& noise);

/// Whether neither rate nor force changed over `window` before `now`; that is so at rest, and on an
/// even drive. False where the samples do not reach back so far.
bool imuIsEven(const ImuBuffer& imu, TimePoint now, Duration window, const ImuNoise& noise);

/// The memory of having stood.
class Standstill {
 public:
  /// Nothing is known: a start, or motion.
  void forget() { confirmed_.reset(); }
  bool known() const { return confirmed_.has_value(); }
  /// Images say that the body stands at `now`.
  void confirm(TimePoint now, const RestExpectation& expected);
  /// Whether the body, known to have stood, has stood since then by the IMU. A push of up to a
  /// second that takes back all that it gave (somebody gets in) interrupts that, and no more.
  bool holds(const ImuBuffer& imu, TimePoint now, const ImuNoise& noise);

 private:
  std::optional<TimePoint> confirmed_;    ///< when images said so last
  std::optional<TimePoint> interrupted_;  ///< since when the IMU contradicts
  TimePoint begun_;                       ///< when images said so first, of this rest
  /// The filter takes a slow push for a bias: what it expects must be older than the push.
  struct Reference {
    TimePoint time;
    RestExpectation expected;
  };
  Reference reference_, next_;
};

}  // namespace perdure::vio

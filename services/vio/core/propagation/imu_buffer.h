// Inertial samples in time order, interpolated at the ends of an interval and if saturated.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"

namespace perdure::vio {

struct ImuReading {
  TimePoint time;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< rad/s, with bias
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< m/s², with bias
  /// Time between the valid samples of an interpolation; 0 between two valid samples.
  double gyro_span_s = 0.0, accel_span_s = 0.0;
};

class ImuBuffer {
 public:
  /// Refuses "imu_not_finite", "imu_duplicate" or "imu_out_of_order". "imu_gyro_saturated" or
  /// "imu_accel_saturated" (twice the same large value): stored, but both values are not used.
  Result<void> add(const ImuReading& reading);
  bool empty() const { return raw_.empty(); }
  TimePoint first() const { return raw_.front().time; }
  TimePoint last() const { return raw_.back().time; }
  /// Readings at `from`, at all samples between, and at `to`; the nearest one outside the samples.
  std::vector<ImuReading> between(TimePoint from, TimePoint to) const;
  /// Writes the same readings into `readings` and reuses its memory.
  void between(TimePoint from, TimePoint to, std::vector<ImuReading>& readings) const;
  Duration longestGap(TimePoint from, TimePoint to) const;
  /// Median interval of the newest samples; empty for fewer than three samples.
  std::optional<Duration> period() const;
  void dropBefore(TimePoint time);
  void clear() { *this = {}; }

 private:
  struct Value {
    TimePoint time;
    Eigen::Vector3d value;
  };
  using Values = std::deque<Value>;
  static Eigen::Vector3d at(const Values& values, TimePoint time);
  static double spanAt(const Values& values, TimePoint time);
  ImuReading reading(TimePoint time) const;

  std::deque<ImuReading> raw_;  ///< samples as received
  Values rates_, forces_;       ///< values without the saturated ones
};

}  // namespace perdure::vio

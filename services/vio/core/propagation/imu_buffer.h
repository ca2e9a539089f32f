// Inertial samples in time order. They are interpolated at the ends of an interval and where they
// are saturated.
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
  /// Time between the two valid samples from which the interval up to this reading is interpolated.
  /// 0 if the interval itself lies between two valid samples.
  double gyro_span_s = 0.0, accel_span_s = 0.0;
};

class ImuBuffer {
 public:
  /// Refuses a sample with "imu_not_finite", "imu_duplicate" or "imu_out_of_order". With
  /// "imu_gyro_saturated" or "imu_accel_saturated" (the same large value twice on an axis) the
  /// sample is stored, but its saturated value and the one before are not used.
  Result<void> add(const ImuReading& reading);
  bool empty() const { return raw_.empty(); }
  TimePoint first() const { return raw_.front().time; }
  TimePoint last() const { return raw_.back().time; }
  /// Returns readings at `from`, at all samples between, and at `to` (from < to). Before the first
  /// and after the last sample, that sample's values are used. Returns nothing if the buffer is
  /// empty.
  std::vector<ImuReading> between(TimePoint from, TimePoint to) const;
  /// Writes the same readings into `readings` and reuses its memory.
  void between(TimePoint from, TimePoint to, std::vector<ImuReading>& readings) const;
  /// Returns the longest gap between samples that overlaps [from, to].
  Duration longestGap(TimePoint from, TimePoint to) const;
  /// Returns the median interval of the newest samples; nothing for fewer than three samples.
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
  Values rates_, forces_;       ///< values that are not saturated
};

}  // namespace perdure::vio

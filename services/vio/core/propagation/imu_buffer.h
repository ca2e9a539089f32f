// Inertial samples in time order, with linear interpolation at the ends of an interval and over
// what was saturated.
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
  /// Time between the two true values that the interval up to this reading is interpolated from;
  /// 0: the interval itself is between two.
  double gyro_span_s = 0.0, accel_span_s = 0.0;
};

class ImuBuffer {
 public:
  /// Refuses "imu_not_finite", "imu_duplicate" and "imu_out_of_order". "imu_gyro_saturated" and
  /// "imu_accel_saturated" (the same large value twice on an axis): the sample is in, those values
  /// and the ones before are not.
  Result<void> add(const ImuReading& reading);
  bool empty() const { return raw_.empty(); }
  TimePoint first() const { return raw_.front().time; }
  TimePoint last() const { return raw_.back().time; }
  /// Readings at from, at all samples between, and at to (from < to). Outside of the samples the
  /// nearest one is held. Empty when there are no samples.
  std::vector<ImuReading> between(TimePoint from, TimePoint to) const;
  /// The same into `readings`, whose memory is used again.
  void between(TimePoint from, TimePoint to, std::vector<ImuReading>& readings) const;
  /// The longest time without a sample inside [from, to].
  Duration longestGap(TimePoint from, TimePoint to) const;
  /// The median distance of the newest samples; nothing before there are three.
  std::optional<Duration> period() const;
  void dropBefore(TimePoint time);
  void clear();

 private:
  struct Value {
    TimePoint time;
    Eigen::Vector3d value;
  };
  using Values = std::deque<Value>;
  static Eigen::Vector3d at(const Values& values, TimePoint time);
  static double spanAt(const Values& values, TimePoint time);
  ImuReading reading(TimePoint time) const;
  static void dropBefore(Values& values, TimePoint time);

  std::deque<ImuReading> raw_;  ///< as they came
  Values rates_, forces_;       ///< without what was saturated
};

}  // namespace perdure::vio

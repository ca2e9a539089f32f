// Inertial samples in time order, with linear interpolation at the ends of an interval.
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
};

class ImuBuffer {
 public:
  /// Refuses "imu_not_finite", "imu_duplicate" and "imu_out_of_order".
  Result<void> add(const ImuReading& reading);
  bool empty() const { return readings_.empty(); }
  TimePoint first() const { return readings_.front().time; }
  TimePoint last() const { return readings_.back().time; }
  /// Readings at from, at all samples between, and at to (from < to). Outside of the samples the
  /// nearest one is held. Empty when there are no samples.
  std::vector<ImuReading> between(TimePoint from, TimePoint to) const;
  /// The longest time without a sample inside [from, to].
  Duration longestGap(TimePoint from, TimePoint to) const;
  /// The median distance of the newest samples; nothing before there are three.
  std::optional<Duration> period() const;
  void dropBefore(TimePoint time);
  void clear() { readings_.clear(); }

 private:
  ImuReading at(TimePoint time) const;
  std::deque<ImuReading> readings_;
};

}  // namespace perdure::vio

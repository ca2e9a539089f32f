// Samples of an accelerometer and a gyroscope that tick apart, as inertial samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "common/base/result.h"

namespace perdure::capture {

/// One reading of three axes; time of CLOCK_BOOTTIME.
struct Triad {
  std::int64_t time_ns = 0;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
};

struct InertialPair {
  std::int64_t time_ns = 0;
  Eigen::Vector3d gyro, accel;
};

/// At each reading of the gyroscope, the acceleration between the readings around it.
class ImuPairing {
 public:
  /// What can be given after this reading, in order of time. Readings that go back in time are
  /// left out: "imu_out_of_order"; those of the gyroscope without accelerations around them within
  /// a tenth of a second: "imu_unpaired".
  std::vector<InertialPair> gyro(const Triad& reading);
  std::vector<InertialPair> accel(const Triad& reading);
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  bool inOrder(std::int64_t& last_ns, const Triad& reading);
  std::vector<InertialPair> pairs();

  std::deque<Triad> gyro_, accel_;
  /// Of the last readings.
  std::int64_t gyro_ns_ = std::numeric_limits<std::int64_t>::min(), accel_ns_ = gyro_ns_;
  ReasonCounts reasons_;
};

}  // namespace perdure::capture

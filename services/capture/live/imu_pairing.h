// Combines an accelerometer's and a gyroscope's readings, whose times differ, into inertial
// samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace perdure::capture {

/// One reading of three axes, with its CLOCK_BOOTTIME.
struct Triad {
  std::int64_t time_ns = 0;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
};

struct InertialPair {
  std::int64_t time_ns = 0;
  Eigen::Vector3d gyro, accel;
};

/// Interpolates the acceleration at each reading of the gyroscope.
class ImuPairing {
 public:
  /// Return the samples that this reading completes, in order of time. A reading whose time does
  /// not increase is dropped and counted as "imu_out_of_order". A gyroscope reading that is not
  /// between two accelerations at most 0.1 s apart is dropped and counted as "imu_unpaired".
  std::vector<InertialPair> gyro(const Triad& reading);
  std::vector<InertialPair> accel(const Triad& reading);
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  bool inOrder(std::int64_t& last_ns, const Triad& reading);
  std::vector<InertialPair> pairs();

  std::deque<Triad> gyro_, accel_;
  std::int64_t gyro_ns_ = std::numeric_limits<std::int64_t>::min(), accel_ns_ = gyro_ns_;
  ReasonCounts reasons_;
};

/// Checks whether the readings of an IMU become samples. If stamps are wrong, readings arrive but
/// give no samples.
class ImuYield {
 public:
  /// Takes the total numbers of readings and of samples. Returns a sentence if fewer than half of
  /// the readings since the last call became samples; otherwise empty.
  std::string look(std::uint64_t read, std::uint64_t given);

 private:
  std::uint64_t read_ = 0, given_ = 0;
};

}  // namespace perdure::capture

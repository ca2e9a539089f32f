#include "services/capture/live/imu_pairing.h"

#include <fmt/format.h>

#include <utility>

namespace perdure::capture {
namespace {

constexpr std::int64_t kApart_ns = 100'000'000;
constexpr std::int64_t kRemembered_ns = 1'000'000'000;

}  // namespace

bool ImuPairing::inOrder(std::int64_t& last_ns, const Triad& reading) {
  if (reading.time_ns <= last_ns) {
    reasons_.add("imu_out_of_order");
    return false;
  }
  last_ns = reading.time_ns;
  return true;
}

std::vector<InertialPair> ImuPairing::gyro(const Triad& reading) {
  if (!inOrder(gyro_ns_, reading)) return {};
  gyro_.push_back(reading);
  return pairs();
}

std::vector<InertialPair> ImuPairing::accel(const Triad& reading) {
  if (!inOrder(accel_ns_, reading)) return {};
  accel_.push_back(reading);
  while (accel_ns_ - accel_.front().time_ns > kRemembered_ns) accel_.pop_front();
  return pairs();
}

std::vector<InertialPair> ImuPairing::pairs() {
  std::vector<InertialPair> result;
  for (; !gyro_.empty(); gyro_.pop_front()) {
    const Triad& g = gyro_.front();
    while (accel_.size() > 1 && accel_[1].time_ns <= g.time_ns) accel_.pop_front();
    const bool before = !accel_.empty() && accel_.front().time_ns <= g.time_ns;
    if (before && accel_.front().time_ns == g.time_ns) {
      result.push_back({g.time_ns, g.v, accel_.front().v});
      continue;
    }
    const bool may_come = accel_.empty() || (before && accel_.size() < 2);
    if (may_come && gyro_ns_ - g.time_ns < kApart_ns) break;
    if (!before || accel_.size() < 2 || accel_[1].time_ns - accel_[0].time_ns > kApart_ns) {
      reasons_.add("imu_unpaired");
      continue;
    }
    const double share = static_cast<double>(g.time_ns - accel_[0].time_ns) /
                         static_cast<double>(accel_[1].time_ns - accel_[0].time_ns);
    result.push_back({g.time_ns, g.v, accel_[0].v + share * (accel_[1].v - accel_[0].v)});
  }
  return result;
}

std::string ImuYield::look(std::uint64_t read, std::uint64_t given) {
  // Fewer readings are not assessed, because one or two blocks may be in transit.
  constexpr std::uint64_t kFew = 10;
  const std::uint64_t more_read = read - std::exchange(read_, read);
  const std::uint64_t more_given = given - std::exchange(given_, given);
  if (more_read < kFew || 2 * more_given >= more_read) return {};
  return fmt::format(
      "of {} readings of the IMU {} became samples: the others go back in time "
      "(imu_out_of_order) or have no partner (imu_unpaired); look at the device's "
      "current_timestamp_clock, and at the rates where there are two devices.",
      more_read, more_given);
}

}  // namespace perdure::capture

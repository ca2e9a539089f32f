#include "services/capture/live/imu_yield.h"

#include <fmt/format.h>

#include <utility>

namespace perdure::capture {

std::string ImuYield::look(std::uint64_t read, std::uint64_t given) {
  // fewer samples are not judged, because one or two blocks may be in transit
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

#include "common/replay/stamp_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/replay/files/stamps.h"

namespace perdure::replay {
namespace {

using StampGrade = DataFinding::Grade;
using StampList = std::vector<TimePoint>;

/// The median interval of ordered stamps in ns, without equal stamps.
std::optional<double> intervalOf(StampList stamps) {
  std::sort(stamps.begin(), stamps.end());
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const Duration interval = between(stamps[i], stamps[i - 1]);
    if (interval > Duration{0}) intervals.push_back(interval.count());
  }
  constexpr std::size_t kFewIntervals = 5;
  if (intervals.size() < kFewIntervals) return std::nullopt;
  return static_cast<double>(medianOf(std::move(intervals)));
}

StampList stampsOfImu(const Recording& recording) {
  StampList stamps;
  for (const ImuSample& sample : recording.imu) stamps.push_back(sample.time);
  return stamps;
}
StampList stampsOfCamera(const Recording& recording) {
  StampList stamps;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0) stamps.push_back(frame.time);
  }
  return stamps;
}

/// `repeated` stamps were left out, because they were equal to earlier ones.
bool checkEqual(const char* of, std::uint64_t repeated, std::size_t kept, DataFindings& findings) {
  const auto all = repeated + kept;
  const bool unusable = 10 * kept < all;
  // A list with each line twice has lost no data.
  if (2 * repeated <= all || repeated < 3) return false;
  findings.push_back(
      {unusable ? StampGrade::kFatal : StampGrade::kWarning, "stamps_equal",
       fmt::format("{} of {} stamps of the {} are equal to another: they lost digits (written as "
                   "float?){}; write them as integers of nanoseconds or with 9 decimals",
                   repeated, all, of, unusable ? "" : ", or are those of packets")});
  return unusable;
}

/// Detects the counts 0, 1, 2 … in place of times.
void checkCount(const char* of, const StampList& stamps, DataFindings& findings) {
  constexpr std::int64_t kHighest = 100'000'000;
  if (stamps.empty() || toNanoseconds(stamps.back()) > kHighest) return;
  const auto interval = intervalOf(stamps);
  const auto first = toNanoseconds(stamps.front());
  if (!interval || *interval != 1.0 || first > 10'000'000) return;
  findings.push_back(
      {StampGrade::kFatal, "stamps_count",
       fmt::format(
           "the stamps of the {} ({} … {}) count them and are no times: write when each was "
           "taken, in nanoseconds, on the clock of the other sensors",
           of, first, toNanoseconds(stamps.back()))});
}

}  // namespace

std::int64_t factorOfStamps(StampList imu, StampList images) {
  const auto of_imu = intervalOf(std::move(imu)), of_images = intervalOf(std::move(images));
  if (!of_imu || !of_images) return 1;
  for (const std::int64_t factor : {1, 1'000, 1'000'000}) {
    const double scale = 1e-9 * static_cast<double>(factor);
    const double imu_hz = 1.0 / (*of_imu * scale), images_hz = 1.0 / (*of_images * scale);
    if (imu_hz >= 20.0 && imu_hz <= 4000.0 && images_hz >= 1.0 && images_hz <= 200.0) return factor;
  }
  return 1;
}

void checkStamps(const Recording& recording, const DataUse& use, DataFindings& findings) {
  const bool of_imu = use.imu && !recording.imu.empty();
  const StampList imu = of_imu ? stampsOfImu(recording) : StampList(),
                  images = stampsOfCamera(recording);
  if (of_imu) checkEqual("IMU", recording.reasons.of("imu_not_increasing"), imu.size(), findings);
  checkEqual("images", recording.reasons.of("frame_not_increasing"), images.size(), findings);
  // Frames without IMU may be numbered if there are no other times, as in KITTI tracking.
  if (!of_imu || images.empty()) return;
  const auto factor = factorOfStamps(imu, images);
  if (factor == 1) {  // also detects 1 kHz samples in whole ms
    checkCount("images", images, findings);
    checkCount("samples of the IMU", imu, findings);
    return;
  }
  findings.push_back(
      {StampGrade::kFatal, "stamps_unit",
       fmt::format("the stamps are in {}, not nanoseconds (in those images would come every {:.0f} "
                   "ns and inertial samples every {:.0f} ns): multiply them by {}, or let perdure "
                   "doctor --data DRIVE --fix COPY do it",
                   factor == 1000 ? "µs" : "ms", *intervalOf(images), *intervalOf(imu), factor)});
}

}  // namespace perdure::replay

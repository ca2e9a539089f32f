// Checks the unit of length of given poses.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "common/base/algorithms/median.h"
#include "tools/data_check/poses/pose_check.h"
#include "tools/data_check/poses/pose_pushes.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using replay::StampedPose;
using Grade = DataFinding::Grade;

struct LengthUnit {
  double metres;
  const char* name;
  double widest;  ///< largest most/least for a match: a scale of no unit may be near it
};
constexpr double kAny = 1e9;
constexpr std::array kLengthUnits{
    LengthUnit{0.001, "millimetres", kAny}, LengthUnit{0.01, "centimetres", kAny},
    LengthUnit{0.3048, "feet", 1.25}, LengthUnit{1000.0, "kilometres", kAny}};

DataFindings unitFinding(const Scale& scale) {
  const char* perhaps = "";
  for (const LengthUnit& unit : kLengthUnits) {
    if (!scale.fits(unit.metres)) continue;
    if (scale.most > unit.widest * scale.least) {
      perhaps = unit.name;
      continue;
    }
    return {
        {Grade::kFatal, "poses_unit",
         fmt::format("the poses accelerate {:.3g} times as much as the accelerometer says, over "
                     "{} steps of the drive: they are in {}; multiply x, y, z by {:g}",
                     1.0 / scale.metres, scale.steps, unit.name, unit.metres)}};
  }
  const bool no_unit = std::string_view(perhaps).empty();
  return {{Grade::kWarning, "poses_unit",
           fmt::format("the poses accelerate {:.3g} times as much as the accelerometer says, over "
                       "{} steps of the drive: their unit is {:.3g} m ({:.3g} to {:.3g}), which "
                       "{}; poses of one camera have no scale of their own: multiply x, y, z by "
                       "{:.3g}, or see their unit, and that of the accelerometer",
                       1.0 / scale.metres, scale.steps, scale.metres, scale.least, scale.most,
                       no_unit ? "is no unit" : fmt::format("may be {}", perhaps), scale.metres)}};
}

DataFindings judgeSpeed(const std::vector<StampedPose>& poses) {
  constexpr double kStep_s = 0.5, kFastest = 150.0;  // m/s
  std::vector<double> speeds;
  for (std::size_t i = 0, j = 0; i < poses.size(); i = std::max(i + 1, j)) {
    for (j = i; j < poses.size() && toSeconds(poses[j].time - poses[i].time) < kStep_s;) ++j;
    if (j == poses.size()) break;
    speeds.push_back((poses[j].T_WB.p - poses[i].T_WB.p).norm() /
                     toSeconds(poses[j].time - poses[i].time));
  }
  if (speeds.size() < 4) return {};
  const double median = medianOf(speeds);
  if (median < kFastest) return {};
  return {
      {Grade::kWarning, "poses_too_fast",
       fmt::format("the poses move at {:.3g} m/s (median of {} steps), faster than what carries "
                   "a camera: see whether they are in metres and their times in seconds",
                   median, speeds.size())}};
}

/// The shared fraction of the accelerations if the poses' times are increased by `later`.
double commonAt(std::vector<StampedPose> poses, const replay::Recording& recording,
                const TurnIntegral& gyro, double seconds, Duration later) {
  for (StampedPose& pose : poses) pose.time += later;
  const auto scale = scaleOf(pushesOf(poses, recording, gyro, seconds));
  return scale ? scale->common : 0.0;
}

}  // namespace

DataFindings judgePosesByPushes(const std::vector<StampedPose>& poses,
                                const replay::Recording& recording) {
  constexpr double kStep_s = 0.3, kSound = 0.75, kExplained = 0.85, kClearly = 3.0;
  constexpr Duration kEach = std::chrono::milliseconds(50), kMost = std::chrono::seconds(2),
                     kShown = std::chrono::milliseconds(100);
  if (!measuresGravity(recording.imu) || recording.calibration.cameras.empty()) return {};
  const TurnIntegral gyro(recording.imu);
  const auto leftAt = [&](Duration later) {
    return 1.0 - commonAt(poses, recording, gyro, kStep_s, later);
  };
  const double now = leftAt(Duration{0});
  if (now < 1.0 - kSound) return {};
  double least = std::min(1.0 - kExplained, now / kClearly);
  Duration best{0};
  for (Duration later = -kMost; later <= kMost; later += kEach) {
    if (const double left = leftAt(later); left < least) least = left, best = later;
  }
  if (std::chrono::abs(best) < kShown) return {};
  return {posesAtOtherTimes("by the accelerometer the body speeds up", toSeconds(best),
                            std::chrono::abs(best) >= kMost)};
}

DataFindings judgePoseUnit(const std::vector<StampedPose>& poses,
                           const replay::Recording& recording) {
  constexpr double kCommon = 0.5, kFactor = 2.0, kClearly = 0.9, kClearFactor = 1.4;
  const auto best = bestScale(poses, recording);
  if (best && best->common > kCommon) {
    const double factor = best->common > kClearly ? kClearFactor : kFactor;
    const bool sound = best->least < factor && best->most > 1.0 / factor;
    return sound ? DataFindings() : unitFinding(*best);
  }
  return judgeSpeed(poses);
}

}  // namespace perdure::tools

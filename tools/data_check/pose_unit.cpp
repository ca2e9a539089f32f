// The unit of length of given poses.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "tools/data_check/pose_check.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using replay::StampedPose;
using Grade = DataFinding::Grade;

/// About one pose, in W: acceleration by the poses, the mean specific force over the same time,
/// weighted as a second difference weighs it, and R_WB.
struct Push {
  Eigen::Vector3d by_poses, by_imu;
  Eigen::Matrix3d R_WB;
};

/// Mean of the specific force around `middle`, in B at that time; weights fall to 0 at both ends.
std::optional<Eigen::Vector3d> meanForce(const std::vector<ImuSample>& samples,
                                         const TurnIntegral& gyro, TimePoint from, TimePoint middle,
                                         TimePoint to) {
  if (!gyro.covers(from, to)) return std::nullopt;
  auto sample = std::lower_bound(samples.begin(), samples.end(), from,
                                 [](const ImuSample& one, TimePoint t) { return one.time < t; });
  const Eigen::Quaterniond q = gyro.at(middle).conjugate();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0.0;
  std::size_t count = 0;
  for (; sample != samples.end() && sample->time < to; ++sample, ++count) {
    const bool before = sample->time < middle;
    const double far = before ? toSeconds(middle - sample->time) / toSeconds(middle - from)
                              : toSeconds(sample->time - middle) / toSeconds(to - middle);
    const double weight = 1.0 - far;
    sum += weight * (q * gyro.at(sample->time) * sample->accel);
    weights += weight;
  }
  constexpr std::size_t kFewest = 6;
  if (count < kFewest || weights <= 0.0) return std::nullopt;
  return sum / weights;
}

std::vector<Push> pushesOf(const std::vector<StampedPose>& poses,
                           const replay::Recording& recording, const TurnIntegral& gyro,
                           double seconds) {
  const Duration length = durationFromSeconds(seconds),
                 later = durationFromSeconds(recording.calibration.cameras.front().time_offset_s);
  const auto firstFrom = [&](std::size_t i, TimePoint time) {
    while (i < poses.size() && poses[i].time < time) ++i;
    return i;
  };
  std::vector<Push> pushes;
  for (std::size_t a = 0; a < poses.size();) {
    const std::size_t b = firstFrom(a + 1, poses[a].time + length - length / 20);
    if (b >= poses.size()) break;
    const std::size_t c = firstFrom(b + 1, poses[b].time + length - length / 20);
    if (c >= poses.size()) break;
    const StampedPose &from = poses[a], &middle = poses[b], &to = poses[c];
    a = firstFrom(a + 1, from.time + length / 2);
    if (to.time > from.time + 3 * length) continue;
    const auto force =
        meanForce(recording.imu, gyro, from.time + later, middle.time + later, to.time + later);
    if (!force) continue;
    const double before = toSeconds(middle.time - from.time),
                 after = toSeconds(to.time - middle.time);
    const Eigen::Vector3d change =
        (to.T_WB.p - middle.T_WB.p) / after - (middle.T_WB.p - from.T_WB.p) / before;
    pushes.push_back({2.0 / (before + after) * change, middle.T_WB.q * *force, middle.T_WB.R()});
  }
  return pushes;
}

/// What one metre of the poses is by the accelerometer, at least and at most: noise of the poses
/// lessens the one, noise of the accelerometer raises the other, and both have twice the deviation
/// of a ratio of so many steps.
struct Scale {
  double least, metres, most;
  double common;  ///< share of the accelerations that both have
  std::size_t steps;

  bool fits(double unit) const {
    constexpr double kSystematic = 1.05;  // scale of the accelerometer, clocks, smoothed poses
    return least < kSystematic * unit && most > unit / kSystematic;
  }
};

/// Gravity and the bias are free.
std::optional<Scale> scaleOf(const std::vector<Push>& pushes) {
  constexpr std::size_t kFewest = 12;
  if (pushes.size() < kFewest) return std::nullopt;
  const auto rows = static_cast<Eigen::Index>(3 * pushes.size());
  Eigen::MatrixXd free(rows, 6), both(rows, 2);
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    free.block<3, 3>(row, 0).setIdentity();
    free.block<3, 3>(row, 3) = pushes[i].R_WB;
    both.block<3, 1>(row, 0) = pushes[i].by_poses;
    both.block<3, 1>(row, 1) = pushes[i].by_imu;
  }
  const Eigen::Matrix<double, 6, 6> A =
      free.transpose() * free + 1e-6 * static_cast<double>(rows) * Eigen::MatrixXd::Identity(6, 6);
  both -= free * A.ldlt().solve(free.transpose() * both);
  const double poses = both.col(0).squaredNorm(), imu = both.col(1).squaredNorm();
  const double product = both.col(0).dot(both.col(1));
  if (poses <= 0.0 || imu <= 0.0 || product <= 0.0) return std::nullopt;
  const double common = product * product / (poses * imu);
  // Steps overlap by half.
  const double deviation =
      std::sqrt(2.0 * (1.0 - common) / (common * static_cast<double>(rows - 8)));
  const double spread = std::exp(2.0 * deviation);
  return Scale{product / poses / spread, std::sqrt(imu / poses), imu / product * spread, common,
               pushes.size()};
}

struct LengthUnit {
  double metres;
  const char* name;
  double widest;  ///< most/least up to which it is named: a scale of no unit may be near it
};
constexpr double kAny = 1e9;
constexpr std::array kLengthUnits{
    LengthUnit{0.001, "millimetres", kAny}, LengthUnit{0.01, "centimetres", kAny},
    LengthUnit{0.3048, "feet", 1.25}, LengthUnit{1000.0, "kilometres", kAny}};

/// Gravity is what it measures most of the time.
bool measuresGravity(const std::vector<ImuSample>& samples) {
  constexpr double kLeast = 7.0, kMost = 14.0;
  if (samples.size() < 2) return false;
  std::vector<double> forces;
  for (const ImuSample& sample : samples) forces.push_back(sample.accel.norm());
  const auto middle = forces.begin() + static_cast<std::ptrdiff_t>(forces.size() / 2);
  std::nth_element(forces.begin(), middle, forces.end());
  return *middle > kLeast && *middle < kMost;
}

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
  const auto middle = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() / 2);
  std::nth_element(speeds.begin(), middle, speeds.end());
  if (*middle < kFastest) return {};
  return {
      {Grade::kWarning, "poses_too_fast",
       fmt::format("the poses move at {:.3g} m/s (median of {} steps), faster than what carries "
                   "a camera: see whether they are in metres and their times in seconds",
                   *middle, speeds.size())}};
}

}  // namespace

DataFindings judgePoseUnit(const std::vector<StampedPose>& poses,
                           const replay::Recording& recording) {
  constexpr double kCommon = 0.5, kFactor = 2.0, kClearly = 0.9, kClearFactor = 1.4;
  std::optional<Scale> best;
  if (measuresGravity(recording.imu) && !recording.calibration.cameras.empty()) {
    const TurnIntegral gyro(recording.imu);
    for (const double seconds : {0.3, 1.0, 2.0}) {
      const auto scale = scaleOf(pushesOf(poses, recording, gyro, seconds));
      if (scale && (!best || scale->common > best->common)) best = scale;
    }
  }
  if (best && best->common > kCommon) {
    const double factor = best->common > kClearly ? kClearFactor : kFactor;
    const bool sound = best->least < factor && best->most > 1.0 / factor;
    return sound ? DataFindings() : unitFinding(*best);
  }
  return judgeSpeed(poses);
}

}  // namespace perdure::tools

#include "tools/data_check/axis_changes.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kFewestChanges = 60;
constexpr double kUnseen = 0.2;  ///< largest correlation of an axis that is another one

/// Changes of rotation rate from one image pair to the next, by images and by gyroscope, in B.
struct AxisChanges {
  std::vector<Vector3d> images, gyro;
};

AxisChanges axisChangesOf(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                          const CameraCalibration& camera) {
  const Matrix3d R_BC = camera.T_BC.R();
  const Duration later = durationFromSeconds(camera.time_offset_s);
  const TurnIntegral gyro(samples);
  const auto rateOf = [&](const Turn& turn) {
    return Vector3d(gyro.between(turn.from + later, turn.to + later) /
                    toSeconds(turn.to - turn.from));
  };
  AxisChanges changes;
  for (std::size_t i = 1; i < turns.size(); ++i) {
    const Turn &a = turns[i - 1], &b = turns[i];
    if (a.to != b.from || !gyro.covers(a.from + later, b.to + later)) continue;
    const Vector3d rate_a = a.of_images / toSeconds(a.to - a.from);
    const Vector3d rate_b = b.of_images / toSeconds(b.to - b.from);
    changes.images.push_back(R_BC * (rate_b - rate_a));
    changes.gyro.push_back(rateOf(b) - rateOf(a));
  }
  return changes;
}

Matrix3d correlationOf(const AxisChanges& changes) {
  Matrix3d both = Matrix3d::Zero();
  Vector3d images = Vector3d::Constant(1e-18), gyro = images;
  for (std::size_t i = 0; i < changes.images.size(); ++i) {
    both += changes.images[i] * changes.gyro[i].transpose();
    images += changes.images[i].cwiseAbs2(), gyro += changes.gyro[i].cwiseAbs2();
  }
  return images.cwiseSqrt().cwiseInverse().asDiagonal() * both *
         gyro.cwiseSqrt().cwiseInverse().asDiagonal();
}

/// The axis of the gyroscope, with its sign, for each axis of B.
struct Axes {
  std::array<int, 3> axis{0, 1, 2};
  Vector3d sign = Vector3d::Ones();
};

/// Returns the axes with the largest sum of absolute correlations.
Axes bestAxes(const Matrix3d& correlation) {
  Axes best, tried;
  double most = -1e9;
  do {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double one = correlation(i, tried.axis[static_cast<std::size_t>(i)]);
      tried.sign[i] = one < 0.0 ? -1.0 : 1.0;
      sum += std::abs(one);
    }
    if (sum > most) most = sum, best = tried;
  } while (std::next_permutation(tried.axis.begin(), tried.axis.end()));
  return best;
}

std::string axesText(const Axes& axes) {
  std::array<std::string, 3> names;
  for (int i = 0; i < 3; ++i) {
    names[static_cast<std::size_t>(i)] = fmt::format("{}{}", axes.sign[i] < 0.0 ? "−" : "",
                                                     "xyz"[axes.axis[static_cast<std::size_t>(i)]]);
  }
  return fmt::format("{}, {}, {}", names[0], names[1], names[2]);
}

}  // namespace

AxisCorrelation correlationOfAxes(const std::vector<Turn>& turns,
                                  const std::vector<ImuSample>& samples,
                                  const CameraCalibration& camera) {
  const AxisChanges changes = axisChangesOf(turns, samples, camera);
  return {correlationOf(changes), changes.images.size()};
}

std::vector<ImuSample> livelinessOfAxes(const std::vector<ImuSample>& samples) {
  constexpr Duration kHalf = std::chrono::milliseconds(250);
  std::vector<ImuSample> lively = samples;
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Constant(1e-18);
  std::size_t begin = 0, end = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (; end < samples.size() && samples[end].time <= samples[i].time + kHalf; ++end) {
      sum += samples[end].gyro;
    }
    for (; samples[begin].time < samples[i].time - kHalf; ++begin) sum -= samples[begin].gyro;
    lively[i].gyro = samples[i].gyro - sum / static_cast<double>(end - begin);
    squares += lively[i].gyro.cwiseAbs2();
  }
  const Vector3d scale = (squares / static_cast<double>(samples.size() + 1)).cwiseSqrt();
  for (ImuSample& sample : lively) sample.gyro = sample.gyro.cwiseQuotient(scale);
  return lively;
}

bool axesSurelyAgree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                     const CameraCalibration& camera) {
  // With this correlation in a few changes, more of them would hardly show less than kUnseen.
  constexpr double kAgree = 0.5;
  constexpr std::size_t kFew = 30;
  const AxisCorrelation found = correlationOfAxes(turns, samples, camera);
  return found.count >= kFew && found.of.diagonal().minCoeff() > kAgree;
}

replay::DataFindings judgeAxisChanges(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera) {
  constexpr double kSurely = 4.0;  // limit, in standard deviations of a chance correlation
  constexpr double kSeen = 0.4;
  const auto [correlation, count] = correlationOfAxes(turns, samples, camera);
  if (count < kFewestChanges) return {};
  const double chance = 1.0 / std::sqrt(static_cast<double>(count));
  Axes axes = bestAxes(correlation);
  bool others = false;
  for (int i = 0; i < 3; ++i) {
    const int axis = axes.axis[static_cast<std::size_t>(i)];
    const double found = std::abs(correlation(i, axis));
    if (axis == i && axes.sign[i] > 0.0) continue;
    const bool sure = found > std::max(kSeen, kSurely * chance);
    if (axis == i && !sure) {  // axis without rotation
      axes.sign[i] = 1.0;
      continue;
    }
    if (!sure || correlation(i, i) > kUnseen) return {};
    others = true;
  }
  if (!others) return {};
  return {
      {replay::DataFinding::Grade::kWarning, "gyro_axes",
       fmt::format("the images of {} turn as if the body's x, y, z were the gyroscope's {}: see "
                   "the order and signs of its columns, and T_BS",
                   camera.name, axesText(axes))}};
}

}  // namespace perdure::tools

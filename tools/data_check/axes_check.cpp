#include "tools/data_check/axes_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "tools/data_check/turn_integral.h"

namespace perdure::tools {
namespace {

/// Row i of the correct gyroscope rates is `sign[i]` times row `from[i]` of the recorded ones.
struct SignedAxes {
  std::array<Eigen::Index, 3> from{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};

  bool changes(Eigen::Index i) const {
    const auto at = static_cast<std::size_t>(i);
    return from[at] != i || sign[at] < 0;
  }
  bool exchanges() const { return from != SignedAxes().from; }
  bool mirrors() const {
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) M(static_cast<Eigen::Index>(i), from[i]) = sign[i];
    return M.determinant() < 0.0;
  }
};

/// The 24 signed axis permutations with determinant -1.
std::vector<SignedAxes> mirroredAxes() {
  std::vector<SignedAxes> all;
  SignedAxes axes;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      for (int i = 0; i < 3; ++i) axes.sign[static_cast<std::size_t>(i)] = signs >> i & 1 ? -1 : 1;
      if (axes.mirrors()) all.push_back(axes);
    }
  } while (std::next_permutation(axes.from.begin(), axes.from.end()));
  return all;
}

/// Share of the image rotation about axis i that the gyroscope, corrected by `axes`, does not
/// explain.
double leftAbout(const TurnPairs& pairs, const SignedAxes& axes, Eigen::Index i) {
  const auto at = static_cast<std::size_t>(i);
  return (pairs.reference.row(i) - axes.sign[at] * pairs.given.row(axes.from[at])).squaredNorm() /
         std::max(1e-18, pairs.reference.row(i).squaredNorm());
}

std::string textOf(const SignedAxes& axes) {
  std::string text;
  for (std::size_t i = 0; i < 3; ++i) {
    text += fmt::format("{}w_{} = {}w_{}", i == 0 ? "" : ", ", "xyz"[i],
                        axes.sign[i] < 0 ? "-" : "", "xyz"[static_cast<std::size_t>(axes.from[i])]);
  }
  return text;
}

/// Shares of the image rotation that the gyroscope does not explain after a change of axes.
struct Left {
  double of_changed;  ///< mean share over the axes that change
  double of_all;      ///< share of the whole rotation
};

/// Returns nothing unless the change clearly improves every axis that it changes.
std::optional<Left> leftBy(const TurnPairs& pairs, const SignedAxes& axes, double least_rad) {
  constexpr double kWrong = 0.4, kRight = 0.3, kClearly = 3.0;
  const double count = std::max<double>(1.0, static_cast<double>(pairs.count()));
  double sum = 0.0, before = 0.0, changed = 0.0, all = 0.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double left = leftAbout(pairs, axes, i), turning = pairs.reference.row(i).squaredNorm();
    all += left * turning;
    if (!axes.changes(i)) continue;
    if (turning < count * least_rad * least_rad) return std::nullopt;
    const double now = leftAbout(pairs, {}, i);
    if (left > kRight || kClearly * left > now) return std::nullopt;
    sum += left, before += now, changed += 1.0;
  }
  if (changed == 0.0 || before < kWrong * changed) return std::nullopt;
  return Left{sum / changed, all / std::max(1e-18, pairs.reference.squaredNorm())};
}

/// Rotations by images, in B, and by gyroscope.
TurnPairs pairsInBody(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                      const CameraCalibration& camera) {
  const TurnIntegral gyro(samples);
  const Duration later = durationFromSeconds(camera.time_offset_s);
  std::vector<Eigen::Vector3d> images, said;
  for (const Turn& turn : turns) {
    if (!gyro.covers(turn.from + later, turn.to + later)) continue;
    images.push_back(camera.T_BC.q * turn.of_images);
    said.push_back(gyro.between(turn.from + later, turn.to + later));
  }
  return {images, said};
}

/// The other explanation if the images turn `shown` times as much about an axis of the body: other
/// pixels per angle along one axis of the image.
std::string squeezeText(const CameraCalibration& camera, Eigen::Index axis, double shown) {
  constexpr double kAlong = 0.8;
  const Eigen::Vector3d axis_C = camera.T_BC.q.conjugate() * Eigen::Vector3d::Unit(axis);
  const bool along_x = std::abs(axis_C.y()) > kAlong;
  if (!along_x && std::abs(axis_C.x()) < kAlong) return {};
  return fmt::format(
      ", or whether the images are squeezed or stretched along {0}: f{0} = {1:.0f} px "
      "would fit",
      along_x ? "x" : "y", shown * (along_x ? camera.fx : camera.fy));
}

constexpr std::size_t kFewestPairs = 12;

}  // namespace

replay::DataFindings judgeConstantAxis(const std::vector<Turn>& turns,
                                       const std::vector<ImuSample>& samples,
                                       const CameraCalibration& camera) {
  constexpr double kMuch_px = 1.0;
  const TurnPairs pairs = pairsInBody(turns, samples, camera);
  if (pairs.count() < kFewestPairs) return {};
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = samples.front().gyro;
  for (const auto& one : samples) spread = spread.cwiseMax((one.gyro - first).cwiseAbs());
  if (spread.isZero()) return {};  // gyro_constant
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double turning_px = camera.fx * std::sqrt(pairs.reference.row(i).squaredNorm() /
                                                    static_cast<double>(pairs.count()));
    if (spread[i] > 0.0 || turning_px < kMuch_px) continue;
    return {{replay::DataFinding::Grade::kFatal, "gyro_axis_constant",
             fmt::format("the gyroscope's w_{} is {:.4g} rad/s in all {} samples while the images "
                         "turn about this axis ({:.2g} px from one to the next): it is off, or "
                         "its column was not recorded",
                         "xyz"[i], first[i], samples.size(), turning_px)}};
  }
  return {};
}

replay::DataFindings judgeAxes(const std::vector<Turn>& turns,
                               const std::vector<ImuSample>& samples,
                               const CameraCalibration& camera) {
  constexpr double kEnough_px = 0.1, kMuch_px = 2.0;
  const TurnPairs pairs = pairsInBody(turns, samples, camera);
  if (pairs.count() < kFewestPairs) return {};
  std::optional<Left> least;
  SignedAxes best;
  for (const SignedAxes& axes : mirroredAxes()) {
    const auto left = leftBy(pairs, axes, kEnough_px / camera.fx);
    if (left && (!least || left->of_all < least->of_all)) least = left, best = axes;
  }
  if (!least) return {};
  // An exchange of axes is certain. A single changed sign may also come from a trajectory around a
  // near object.
  const bool sure = best.exchanges() && leftBy(pairs, best, kMuch_px / camera.fx);
  return {{sure ? replay::DataFinding::Grade::kFatal : replay::DataFinding::Grade::kWarning,
           "gyro_axes",
           fmt::format("the images turn as if the gyroscope's axes were others: {} leave {:.0f} % "
                       "of their turning about these axes unexplained, in {} pairs of images: see "
                       "the order and the signs of its columns, or the axes of T_BS",
                       textOf(best), 100.0 * least->of_changed, pairs.count())}};
}

replay::DataFindings judgeAxisFactors(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera) {
  // A translation beside near objects resembles a small rotation.
  constexpr double kLeast = 0.15, kSurely = 4.0, kLeft = 0.05, kMuch_px = 1.0;
  const TurnPairs pairs = pairsInBody(turns, samples, camera);
  if (pairs.count() < kFewestPairs) return {};
  const auto count = static_cast<double>(pairs.count());
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto images = pairs.reference.row(i), said = pairs.given.row(i);
    const double all = std::max(1e-18, said.squaredNorm()), turning = images.squaredNorm();
    const double shown = images.dot(said) / all, left = (images - shown * said).squaredNorm();
    const bool seen = camera.fx * std::sqrt(turning / count) > kMuch_px && left < kLeft * turning;
    const double least = kLeast + kSurely * std::sqrt(left / (count * all));
    if (!seen || shown <= 0.0 || std::abs(shown - 1.0) < least) continue;
    return {{replay::DataFinding::Grade::kCause, "gyro_axis_factor",
             fmt::format("the gyroscope's w_{} is {:.2f} times the turning about this axis that {} "
                         "shows, in {} pairs of images: see the scale of this column{}",
                         "xyz"[i], 1.0 / shown, camera.name, pairs.count(),
                         squeezeText(camera, i, shown))}};
  }
  return {};
}

}  // namespace perdure::tools

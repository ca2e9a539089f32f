#include "tools/calibrate/estimate/alignment.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::calibrate {
namespace {

constexpr double kLongestPair = 0.25;  ///< s, longest time between two compared views
constexpr double kTimeStep = 0.0025;   ///< s, step of the search for the time offset
constexpr double kLeastSpread = 0.02;  ///< rad/s, least rotation about a second axis

struct Turn {
  double from_s, to_s;
  Eigen::Vector3d rate_C;  ///< mean over the time between two views
};

std::vector<Turn> turnsOf(const std::vector<CameraPose>& poses) {
  std::vector<Turn> turns;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double dt = poses[i].time_s - poses[i - 1].time_s;
    if (dt <= 0.0 || dt > kLongestPair) continue;
    const Eigen::Vector3d angle = logSo3(poses[i - 1].T_TC.q.conjugate() * poses[i].T_TC.q);
    turns.push_back({poses[i - 1].time_s, poses[i].time_s, angle / dt});
  }
  return turns;
}

/// Computes the mean of the gyroscope's rates over any time interval.
class GyroMean {
 public:
  explicit GyroMean(const std::vector<ImuReading>& readings) : readings_(readings) {
    sums_.emplace_back(Eigen::Vector3d::Zero());
    for (std::size_t i = 1; i < readings.size(); ++i) {
      const double dt = readings[i].time_s - readings[i - 1].time_s;
      sums_.push_back(sums_.back() + 0.5 * dt * (readings[i].gyro + readings[i - 1].gyro));
    }
  }
  std::optional<Eigen::Vector3d> over(double from, double to) const {
    if (from < readings_.front().time_s || to > readings_.back().time_s) return std::nullopt;
    return (integral(to) - integral(from)) / (to - from);
  }

 private:
  Eigen::Vector3d integral(double t) const {
    const auto after = std::upper_bound(readings_.begin() + 1, readings_.end() - 1, t,
                                        [](double at, const auto& r) { return at < r.time_s; });
    const auto i = static_cast<std::size_t>(after - readings_.begin());
    const auto &a = readings_[i - 1], &b = readings_[i];
    const double s = t - a.time_s, slope = s / (b.time_s - a.time_s);
    return sums_[i - 1] + s * (a.gyro + 0.5 * slope * (b.gyro - a.gyro));
  }

  const std::vector<ImuReading>& readings_;
  std::vector<Eigen::Vector3d> sums_;
};

/// Pairs of angular rates: the body's, and the camera's.
using Pairs = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;

/// Removes the tenth of the pairs whose magnitudes differ most. Magnitudes do not depend on the
/// rotation between body and camera.
void dropUnlike(Pairs& pairs) {
  const auto unlike = [](const auto& pair) {
    return std::abs(pair.first.norm() - pair.second.norm());
  };
  std::ranges::sort(pairs, [&](const auto& a, const auto& b) { return unlike(a) < unlike(b); });
  pairs.resize(pairs.size() - pairs.size() / 10);
}

/// Rotation from the camera's rates to the body's, and a bias (Kabsch; Wahba's problem).
std::optional<Alignment> alignAt(const std::vector<Turn>& turns, const GyroMean& gyro,
                                 double offset) {
  Pairs pairs;
  for (const Turn& turn : turns) {
    const auto rate_B = gyro.over(turn.from_s + offset, turn.to_s + offset);
    if (rate_B) pairs.emplace_back(*rate_B, turn.rate_C);
  }
  if (pairs.size() < turns.size() / 2 || pairs.size() < 20) return std::nullopt;
  dropUnlike(pairs);
  Eigen::Vector3d mean_B = Eigen::Vector3d::Zero(), mean_C = mean_B;
  for (const auto& [b, c] : pairs) mean_B += b, mean_C += c;
  const auto count = static_cast<double>(pairs.size());
  mean_B /= count, mean_C /= count;
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const auto& [b, c] : pairs) M += (b - mean_B) * (c - mean_C).transpose() / count;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  Alignment out;
  const Eigen::Matrix3d R_BC = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  out.q_BC = Eigen::Quaterniond(R_BC);
  out.time_offset_s = offset;
  out.gyro_bias = mean_B - R_BC * mean_C;
  out.spread = svd.singularValues().cwiseSqrt();
  double sum = 0.0;
  for (const auto& [b, c] : pairs) {
    sum += (b - out.gyro_bias - R_BC * c).squaredNorm();
    out.rate_rms_B += (b - out.gyro_bias).cwiseAbs2() / count;
  }
  out.rate_rms_B = out.rate_rms_B.cwiseSqrt();
  out.rms = std::sqrt(sum / count);
  return out;
}

}  // namespace

Result<Alignment> alignRates(const std::vector<CameraPose>& poses,
                             const std::vector<ImuReading>& readings, double widest_s) {
  const auto turns = turnsOf(poses);
  if (turns.size() < 20 || readings.size() < 20) {
    return fail("calibrate_few_views",
                "fewer than 20 pairs of neighbouring images show the board while inertial samples "
                "come; keep the board in view, and record both");
  }
  const GyroMean gyro(readings);
  std::optional<Alignment> best;
  const int steps = static_cast<int>(std::ceil(widest_s / kTimeStep));
  for (int i = -steps; i <= steps; ++i) {
    const auto at = alignAt(turns, gyro, i * kTimeStep);
    if (at && (!best || at->rms < best->rms)) best = at;
  }
  if (!best) {
    return fail("calibrate_time_offset",
                "images and inertial samples hardly overlap in time; are both of one clock?");
  }
  if (best->spread[1] < kLeastSpread) {
    return fail("calibrate_no_rotation",
                "the camera hardly turned about more than one axis; turn it to and fro about all "
                "three, by 20 degrees and about once a second");
  }
  const double moved = best->rate_rms_B.norm();
  if (best->rms > 0.5 * moved || std::abs(best->time_offset_s) > widest_s - 1.5 * kTimeStep) {
    return fail("calibrate_time_offset",
                "the gyroscope does not turn as the camera does at any offset within ±{} s; check "
                "the clocks and that both are on one rigid body, or widen --max-offset",
                widest_s);
  }
  return *best;
}

std::vector<bool> agreeing(const std::vector<CameraPose>& poses,
                           const std::vector<ImuReading>& readings, const Alignment& alignment) {
  constexpr std::ptrdiff_t kNeighbours = 4;  // neighbours on each side
  constexpr double kMost = 0.3;              // rad, largest difference of rotation
  const GyroMean gyro(readings);
  std::vector<bool> good;
  const auto count = static_cast<std::ptrdiff_t>(poses.size());
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    int for_it = 0, against = 0;
    const CameraPose& here = poses[static_cast<std::size_t>(i)];
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, i - kNeighbours);
         k <= std::min(count - 1, i + kNeighbours); ++k) {
      const CameraPose& there = poses[static_cast<std::size_t>(k)];
      const double dt = there.time_s - here.time_s, offset = alignment.time_offset_s;
      if (k == i || std::abs(dt) > kLongestPair) continue;
      const auto rate_B = gyro.over(std::min(here.time_s, there.time_s) + offset,
                                    std::max(here.time_s, there.time_s) + offset);
      if (!rate_B) continue;
      const Eigen::Vector3d turned_C =
          dt * (alignment.q_BC.conjugate() * (*rate_B - alignment.gyro_bias));
      const Eigen::Quaterniond seen = here.T_TC.q.conjugate() * there.T_TC.q;
      const double error = logSo3(expQuaternion(turned_C).conjugate() * seen).norm();
      ++(error < kMost ? for_it : against);
    }
    good.push_back(for_it >= against);
  }
  return good;
}

}  // namespace perdure::calibrate

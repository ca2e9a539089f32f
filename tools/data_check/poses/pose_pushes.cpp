#include "tools/data_check/poses/pose_pushes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/algorithms/median.h"

namespace perdure::tools {
namespace {

using replay::StampedPose;

constexpr std::size_t kFewestPushes = 12;

/// Weighted mean of the specific force, in B at time `middle`. The weights decrease to 0 at `from`
/// and `to`.
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

/// Removes the parts of accelerations (three rows per push) that gravity or a bias explains.
void takeFree(const std::vector<Push>& pushes, Eigen::MatrixXd& columns) {
  Eigen::MatrixXd free(columns.rows(), 6);
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    free.block<3, 3>(row, 0).setIdentity();
    free.block<3, 3>(row, 3) = pushes[i].R_WB;
  }
  const Eigen::Matrix<double, 6, 6> A =
      free.transpose() * free +
      1e-6 * static_cast<double>(columns.rows()) * Eigen::MatrixXd::Identity(6, 6);
  columns -= free * A.ldlt().solve(free.transpose() * columns);
}

}  // namespace

bool measuresGravity(const std::vector<ImuSample>& samples) {
  constexpr double kLeast = 7.0, kMost = 14.0;
  if (samples.size() < 2) return false;
  std::vector<double> forces;
  for (const ImuSample& sample : samples) forces.push_back(sample.accel.norm());
  const double median = medianOf(std::move(forces));
  return median > kLeast && median < kMost;
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

std::optional<Scale> scaleOf(const std::vector<Push>& pushes) {
  if (pushes.size() < kFewestPushes) return std::nullopt;
  const auto rows = static_cast<Eigen::Index>(3 * pushes.size());
  Eigen::MatrixXd both(rows, 2);
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    both.block<3, 1>(row, 0) = pushes[i].by_poses;
    both.block<3, 1>(row, 1) = pushes[i].by_imu;
  }
  takeFree(pushes, both);
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

std::optional<Scale> bestScale(const std::vector<StampedPose>& poses,
                               const replay::Recording& recording) {
  std::optional<Scale> best;
  if (!measuresGravity(recording.imu) || recording.calibration.cameras.empty()) return best;
  const TurnIntegral gyro(recording.imu);
  for (const double seconds : {0.3, 1.0, 2.0}) {
    const auto scale = scaleOf(pushesOf(poses, recording, gyro, seconds));
    if (scale && (!best || scale->common > best->common)) best = scale;
  }
  return best;
}

double pushingOfImu(const std::vector<StampedPose>& poses, const replay::Recording& recording) {
  if (!measuresGravity(recording.imu) || recording.calibration.cameras.empty()) return 0.0;
  const auto pushes = pushesOf(poses, recording, TurnIntegral(recording.imu), 1.0);
  if (pushes.size() < kFewestPushes) return 0.0;
  Eigen::MatrixXd imu(static_cast<Eigen::Index>(3 * pushes.size()), 1);
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    imu.block<3, 1>(static_cast<Eigen::Index>(3 * i), 0) = pushes[i].by_imu;
  }
  takeFree(pushes, imu);
  return std::sqrt(imu.squaredNorm() / static_cast<double>(pushes.size()));
}

}  // namespace perdure::tools

#include "tools/evaluate/trajectory_score.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

double angleOf(const RigidTransform& T) { return logSo3(T.q).norm(); }

std::vector<double> travelled(const std::vector<PosePair>& pairs) {
  std::vector<double> distance{0.0};
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    distance.push_back(distance.back() + (pairs[i].truth.p - pairs[i - 1].truth.p).norm());
  }
  return distance;
}

RigidTransform motionError(const PosePair& a, const PosePair& b) {
  const RigidTransform truth = a.truth.inverse() * b.truth;
  const RigidTransform estimate = a.estimate.inverse() * b.estimate;
  return truth.inverse() * estimate;
}

void scoreRelative(const std::vector<PosePair>& pairs, TrajectoryScore& score) {
  double metres2 = 0.0, radians2 = 0.0;
  std::size_t count = 0, j = 0;
  for (const auto& a : pairs) {
    while (j < pairs.size() && pairs[j].time < a.time + std::chrono::seconds(1)) ++j;
    if (j == pairs.size()) break;
    const RigidTransform error = motionError(a, pairs[j]);
    metres2 += error.p.squaredNorm();
    radians2 += std::pow(angleOf(error), 2);
    ++count;
  }
  if (count == 0) return;
  score.rpe_m = std::sqrt(metres2 / static_cast<double>(count));
  score.rpe_deg = std::sqrt(radians2 / static_cast<double>(count)) * kDegrees;
}

SegmentError scoreSegments(const std::vector<PosePair>& pairs) {
  const auto distance = travelled(pairs);
  SegmentError result;
  double unit = 100.0;
  while (unit > 1.0 && distance.back() < unit) unit /= 10.0;
  for (int i = 1; i <= 8; ++i) result.lengths_m.push_back(unit * i);
  double t = 0.0, r = 0.0;
  for (const double length : result.lengths_m) {
    for (std::size_t a = 0; a < pairs.size(); ++a) {
      const auto end = std::lower_bound(distance.begin() + static_cast<std::ptrdiff_t>(a),
                                        distance.end(), distance[a] + length);
      if (end == distance.end()) break;
      const auto error =
          motionError(pairs[a], pairs[static_cast<std::size_t>(end - distance.begin())]);
      t += error.p.norm() / length;
      r += angleOf(error) / length;
      ++result.segments;
    }
  }
  if (result.segments == 0) return result;
  result.t_err_percent = 100.0 * t / static_cast<double>(result.segments);
  result.r_err_deg_per_m = kDegrees * r / static_cast<double>(result.segments);
  return result;
}

}  // namespace

RigidTransform align(const std::vector<PosePair>& pairs, Alignment alignment) {
  check(!pairs.empty(), "alignment needs poses");
  const double first_yaw = wrapAngle(yawOf(pairs[0].truth.R()) - yawOf(pairs[0].estimate.R()));
  if (alignment == Alignment::kStart) {
    const Eigen::Matrix3d R = rotationAboutZ(first_yaw);
    return RigidTransform(R, Eigen::Vector3d(pairs[0].truth.p - R * pairs[0].estimate.p));
  }
  const auto n = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd estimate(3, n), truth(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    estimate.col(i) = pairs[static_cast<std::size_t>(i)].estimate.p;
    truth.col(i) = pairs[static_cast<std::size_t>(i)].truth.p;
  }
  if (alignment == Alignment::kRigid && n >= 3) {
    const Eigen::Matrix4d T = Eigen::umeyama(estimate, truth, false);
    return RigidTransform(Eigen::Matrix3d(T.topLeftCorner<3, 3>()),
                          Eigen::Vector3d(T.topRightCorner<3, 1>()));
  }
  const Eigen::Vector3d mean_e = estimate.rowwise().mean(), mean_t = truth.rowwise().mean();
  const Eigen::Matrix3d C = (truth.colwise() - mean_t) * (estimate.colwise() - mean_e).transpose();
  // The yaw that maximises trace(Rz' C). If nothing moved, the yaw between the first attitudes.
  const double s = C(1, 0) - C(0, 1), c = C(0, 0) + C(1, 1);
  const bool moved = std::hypot(s, c) > 1e-4 * static_cast<double>(n);
  const double yaw = moved ? std::atan2(s, c) : first_yaw;
  const Eigen::Matrix3d R = rotationAboutZ(yaw);
  return RigidTransform(R, Eigen::Vector3d(mean_t - R * mean_e));
}

TrajectoryScore scoreTrajectory(const std::vector<PosePair>& pairs, Alignment alignment) {
  check(pairs.size() >= 2, "a trajectory has at least two poses");
  const RigidTransform T_GE = align(pairs, alignment);
  TrajectoryScore score;
  score.poses = pairs.size();
  score.length_m = travelled(pairs).back();
  double metres2 = 0.0, radians2 = 0.0;
  for (const auto& pair : pairs) {
    const RigidTransform aligned = T_GE * pair.estimate;
    const double error = (aligned.p - pair.truth.p).norm();
    metres2 += error * error;
    score.ate_max_m = std::max(score.ate_max_m, error);
    radians2 += std::pow(angleOf(pair.truth.inverse() * aligned), 2);
  }
  score.ate_rmse_m = std::sqrt(metres2 / static_cast<double>(pairs.size()));
  score.ate_rotation_deg = std::sqrt(radians2 / static_cast<double>(pairs.size())) * kDegrees;
  score.end_drift_m = motionError(pairs.front(), pairs.back()).p.norm();
  scoreRelative(pairs, score);
  score.segments = scoreSegments(pairs);
  return score;
}

}  // namespace perdure::tools

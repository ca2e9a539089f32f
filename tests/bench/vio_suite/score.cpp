#include "tests/bench/vio_suite/score.h"

#include <algorithm>
#include <cmath>

#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "tools/evaluate/trajectory_score.h"

namespace perdure::bench {
namespace {

using Eigen::Vector3d;
using tools::PosePair;

std::optional<double> relativeOver(const std::vector<PosePair>& pairs, double distance) {
  std::vector<double> way{0.0};
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    way.push_back(way.back() + (pairs[i].truth.p - pairs[i - 1].truth.p).norm());
  }
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t a = 0; a < pairs.size(); ++a) {
    const auto end = std::lower_bound(way.begin() + static_cast<std::ptrdiff_t>(a), way.end(),
                                      way[a] + distance);
    if (end == way.end()) break;
    const PosePair& b = pairs[static_cast<std::size_t>(end - way.begin())];
    const RigidTransform truth = pairs[a].truth.inverse() * b.truth;
    const RigidTransform estimate = pairs[a].estimate.inverse() * b.estimate;
    sum += (truth.inverse() * estimate).p.squaredNorm();
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count)) / distance;
}

double scaleOf(const std::vector<PosePair>& pairs) {
  const RigidTransform T = tools::align(pairs, tools::Alignment::kYaw);
  Vector3d mean_e = Vector3d::Zero(), mean_t = Vector3d::Zero();
  for (const PosePair& p : pairs) {
    mean_e += T * p.estimate.p;
    mean_t += p.truth.p;
  }
  mean_e /= static_cast<double>(pairs.size());
  mean_t /= static_cast<double>(pairs.size());
  double along = 0.0, square = 0.0;
  for (const PosePair& p : pairs) {
    const Vector3d e = T * p.estimate.p - mean_e;
    along += e.dot(p.truth.p - mean_t);
    square += (p.truth.p - mean_t).squaredNorm();
  }
  return square > 0.0 ? along / square : 1.0;
}

std::optional<Vector3d> velocityOf(const replay::PoseFile& truth, TimePoint time) {
  constexpr std::chrono::milliseconds kHalf{20};
  const auto before = truth.at(0, time - kHalf), after = truth.at(0, time + kHalf);
  if (!before || !after) return std::nullopt;
  return Vector3d((after->p - before->p) / toSeconds(2 * kHalf));
}

/// Returns the transform from the truth's world to the estimate's: it aligns position and the
/// rotation about the vertical at one time. It does not compare yaw angles, because yaw is
/// undefined if x points up.
RigidTransform laidOn(const RigidTransform& estimate, const RigidTransform& truth) {
  const Eigen::Matrix3d M = estimate.R() * truth.R().transpose();
  const Eigen::Matrix3d turn = rotationAboutZ(std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1)));
  return RigidTransform(turn, Vector3d(estimate.p - turn * truth.p));
}

/// `T_EG` is the transform from the truth's world to the estimate's.
NeesAt neesAt(const Odometry& o, const RigidTransform& T_EG, const RigidTransform& T_GB,
              const Vector3d& v_G) {
  const RigidTransform T_WB = T_EG * T_GB;
  const Eigen::Matrix3d R = o.T_WB.R();
  const Vector3d theta_W = R * logSo3(o.T_WB.q.conjugate() * T_WB.q);
  const Eigen::Matrix3d P_W = R * o.covariance.topLeftCorner<3, 3>() * R.transpose();
  const Vector3d p = T_WB.p - o.T_WB.p, v = T_EG.q * v_G - o.v_WB;
  return NeesAt{0.0,
                squaredMahalanobis(p, o.covariance.block<3, 3>(3, 3)) / 3.0,
                theta_W.z() * theta_W.z() / P_W(2, 2),
                squaredMahalanobis(v, o.covariance.block<3, 3>(6, 6)) / 3.0,
                p.norm(),
                theta_W.z()};
}

void addNees(const std::vector<Odometry>& odometry, const replay::PoseFile& truth, Duration offset,
             Accuracy& out) {
  const auto first = truth.at(0, odometry.front().stamp.time + offset);
  if (!first) return;
  const Odometry& start = odometry.front();
  const RigidTransform T_EG = laidOn(start.T_WB, *first);
  double next = 10.0;
  for (const Odometry& o : odometry) {
    const double t = toSeconds(o.stamp.time - start.stamp.time);
    if (t < next) continue;
    next += 10.0;
    const auto pose = truth.at(0, o.stamp.time + offset);
    const auto velocity = velocityOf(truth, o.stamp.time + offset);
    if (!pose || !velocity) continue;
    NeesAt nees = neesAt(o, T_EG, *pose, *velocity);
    nees.seconds = t;
    out.nees.push_back(nees);
    const auto judge = [&](double value, int dof) {
      const double total = value * dof;
      out.in_band += total > chi2Quantile(0.025, dof) && total < chi2Quantile(0.975, dof);
      ++out.asked;
    };
    judge(nees.position, 3);
    judge(nees.yaw, 1);
    judge(nees.velocity, 3);
  }
}

}  // namespace

Accuracy accuracyOf(const std::vector<Odometry>& odometry, const replay::PoseFile& truth,
                    double time_offset_s) {
  const Duration offset = durationFromSeconds(time_offset_s);
  Accuracy out;
  std::vector<PosePair> pairs;
  for (const Odometry& o : odometry) {
    const auto pose = truth.at(0, o.stamp.time + offset);
    if (pose) pairs.push_back({o.stamp.time, o.T_WB, *pose});
  }
  out.poses = pairs.size();
  if (pairs.size() < 2) return out;
  const auto score = tools::scoreTrajectory(pairs, tools::Alignment::kYaw);
  out.length_m = score.length_m;
  out.ate_m = score.ate_rmse_m;
  out.scale = scaleOf(pairs);
  for (std::size_t i = 0; i < kDistances.size(); ++i) {
    out.relative[i] = relativeOver(pairs, kDistances[i]);
  }
  addNees(odometry, truth, offset, out);
  return out;
}

StartJudgement judgeStart(const std::vector<Odometry>& odometry, const replay::PoseFile& truth) {
  StartJudgement j;
  const Odometry &start = odometry.front(), &end = odometry.back();
  const auto first = truth.at(0, start.stamp.time), last = truth.at(0, end.stamp.time);
  const auto v_first = velocityOf(truth, start.stamp.time);
  const auto v_last = velocityOf(truth, end.stamp.time);
  if (!first || !last || !v_first || !v_last) return j;
  const RigidTransform T_EG = laidOn(start.T_WB, *first);
  double way = 0.0;
  std::optional<Vector3d> before;
  for (const Odometry& o : odometry) {
    const auto pose = truth.at(0, o.stamp.time);
    if (!pose) continue;
    if (before) j.way_m += (pose->p - *before).norm();
    before = pose->p;
  }
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    way += (odometry[i].T_WB.p - odometry[i - 1].T_WB.p).norm();
  }
  j.scale = j.way_m > 0.0 ? way / j.way_m : 0.0;
  j.nees = neesAt(end, T_EG, *last, *v_last);
  const Vector3d error = T_EG * last->p - end.T_WB.p;
  j.error_m = error.norm();
  j.deviations = std::sqrt(3.0 * j.nees.position);
  j.velocity_error = (T_EG.q * *v_first - start.v_WB).norm();
  j.velocity_sigma = std::sqrt(start.covariance.block<3, 3>(6, 6).trace());
  return j;
}

void Innovations::add(const std::vector<vio::Innovation>& frame) {
  if (frame.empty()) return;
  std::vector<double> x, y;
  for (const vio::Innovation& i : frame) {
    nis_ += i.nis;
    rows_ += i.rows;
    used_ += i.used;
    ++count_;
    x.push_back(i.residual.x());
    y.push_back(i.residual.y());
  }
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  const Eigen::Vector2d now(median(x), median(y));
  if (before_) {
    product_ += now.dot(*before_);
    power_ += now.squaredNorm();
  }
  before_ = now;
}

}  // namespace perdure::bench

#include "common/mapping/graph/drift_scale.h"

#include <algorithm>
#include <cmath>

#include "common/mapping/frames/level_errors.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kLeast = 0.02, kMost = 32.0;
constexpr int kSteps = 64;
constexpr std::size_t kMostLoops = 20;

}  // namespace

DriftScale::DriftScale(const DriftScaleParameters& parameters, const std::vector<Anchor>& way) {
  for (int i = 0; i <= kSteps; ++i) {
    const double log_scale = std::log(kLeast) + (std::log(kMost) - std::log(kLeast)) * i / kSteps;
    const double d = log_scale / parameters.prior_sigma;
    log_scales_.push_back(log_scale);
    plane_.push_back(-0.5 * d * d);
  }
  height_ = plane_;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Anchor& anchor : way) {
    const LevelPose pose = levelOf(anchor.T_WA);
    if (!poses_.empty()) {
      // The increment turns everything after it about its end.
      Eigen::Matrix4d by_increment = byFrame(-pose.p);
      by_increment.topLeftCorner<3, 3>() = poses_.back().R();
      const Eigen::Matrix4d Q =
          DriftVariance().over(anchor.scale).of(anchor.from_previous.covariance);
      sum += by_increment * Q * by_increment.transpose();
    }
    at_[anchor.id] = poses_.size();
    poses_.push_back(pose);
    way_m_.push_back(anchor.way_m);
    sums_.push_back(sum);
  }
}

DriftScale::Measured DriftScale::measuredBy(const Edge& loop) const {
  const std::size_t a = at_.at(loop.a), b = at_.at(loop.b);
  const Eigen::Matrix3d R = poses_[a].R();
  Eigen::Vector4d error = difference(loop.T_ab.mean, poses_[a].inverse() * poses_[b]);
  error.head<3>() = R * error.head<3>();
  return {a, b, error, turnedBy(R, loop.T_ab.covariance)};
}

/// Covariance of the odometry's errors of two relative poses, for a scale of 1.
Eigen::Matrix4d DriftScale::sharedError(const Measured& x, const Measured& y) const {
  const std::size_t from = std::max(x.a, y.a), to = std::min(x.b, y.b);
  if (from >= to) return Eigen::Matrix4d::Zero();
  return byFrame(poses_[x.b].p) * (sums_[to] - sums_[from]) * byFrame(poses_[y.b].p).transpose();
}

bool DriftScale::use(const std::vector<Edge>& loops, double apart_m) {
  std::map<std::int64_t, Measured> best;
  for (const Edge& loop : loops) {
    if (!at_.contains(loop.a) || !at_.contains(loop.b) || at_.at(loop.a) >= at_.at(loop.b))
      continue;
    Measured measured = measuredBy(loop);
    const auto stretch = static_cast<std::int64_t>(way_m_[measured.b] / apart_m);
    const auto [at, first] = best.try_emplace(stretch, measured);
    if (!first && planeSigma(measured.covariance) < planeSigma(at->second.covariance)) {
      at->second = std::move(measured);
    }
  }
  while (best.size() > kMostLoops) best.erase(best.begin());
  if (best.empty()) return false;
  const auto n = static_cast<Eigen::Index>(best.size());
  Eigen::VectorXd e_plane(3 * n), e_height(n);
  Eigen::MatrixXd Q_plane(3 * n, 3 * n), Q_height(n, n);
  Eigen::MatrixXd R_plane = Eigen::MatrixXd::Zero(3 * n, 3 * n),
                  R_height = R_plane.topLeftCorner(n, n);
  const Eigen::Vector3i plane(0, 1, 3);
  Eigen::Index i = 0;
  for (const auto& [at_i, x] : best) {
    e_plane.segment<3>(3 * i) = x.error(plane);
    e_height[i] = x.error[2];
    R_plane.block<3, 3>(3 * i, 3 * i) = x.covariance(plane, plane);
    R_height(i, i) = x.covariance(2, 2);
    Eigen::Index j = 0;
    for (const auto& [at_j, y] : best) {
      const Eigen::Matrix4d shared = sharedError(x, y);
      Q_plane.block<3, 3>(3 * i, 3 * j) = shared(plane, plane);
      Q_height(i, j) = shared(2, 2);
      ++j;
    }
    ++i;
  }
  for (std::size_t k = 0; k < log_scales_.size(); ++k) {
    const double variance = std::exp(2.0 * log_scales_[k]);
    plane_[k] += logGaussian(e_plane, Eigen::MatrixXd(R_plane + variance * Q_plane));
    height_[k] += logGaussian(e_height, Eigen::MatrixXd(R_height + variance * Q_height));
  }
  return true;
}

DriftVariance DriftScale::variance(double quantile) const {
  return {varianceOf(plane_, quantile), varianceOf(height_, quantile)};
}

double DriftScale::varianceOf(const LogPosterior& log_posterior, double quantile) const {
  const double peak = *std::max_element(log_posterior.begin(), log_posterior.end());
  double all = 0.0;
  for (const double l : log_posterior) all += std::exp(l - peak);
  double sum = 0.0;
  for (std::size_t i = 0; i < log_scales_.size(); ++i) {
    sum += std::exp(log_posterior[i] - peak);
    if (sum >= quantile * all) return std::exp(2.0 * log_scales_[i]);
  }
  return std::exp(2.0 * log_scales_.back());
}

}  // namespace perdure::mapping

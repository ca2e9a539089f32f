#include "common/mapping/graph/drift_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/mapping/frames/level_errors.h"
#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

constexpr double kLeast = 0.02, kMost = 32.0;
constexpr int kSteps = 64;
constexpr std::size_t kMostLoops = 12;
const std::vector<int> kPlane = {0, 1, 3};  // indices of x, y and yaw in [p, yaw]

}  // namespace

DriftScale::DriftScale(const DriftScaleParameters& parameters, const std::vector<Anchor>& way) {
  for (int i = 0; i <= kSteps; ++i) {
    const double log_scale = std::log(kLeast) + (std::log(kMost) - std::log(kLeast)) * i / kSteps;
    const double d = (log_scale - std::log(parameters.prior_median)) / parameters.prior_sigma;
    log_scales_.push_back(log_scale);
    plane_.push_back(-0.5 * d * d);
  }
  height_ = plane_;
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Anchor& anchor : way) {
    const LevelPose pose = poses_.empty() ? LevelPose() : poses_.back() * anchor.from_previous.mean;
    if (!poses_.empty()) {
      // The yaw error of an increment turns all later poses about the end of the increment.
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

/// Covariance between the odometry's errors of the T_ab of two loops, for a scale of 1.
Eigen::Matrix4d DriftScale::sharedError(const Measured& x, const Measured& y) const {
  const std::size_t from = std::max(x.a, y.a), to = std::min(x.b, y.b);
  if (from >= to) return Eigen::Matrix4d::Zero();
  return byFrame(poses_[x.b].p) * (sums_[to] - sums_[from]) * byFrame(poses_[y.b].p).transpose();
}

/// All loops as one Gaussian: errors e, covariance Z of the measurements, and covariance C of the
/// odometry for a scale of 1.
struct DriftScale::Joint {
  Eigen::VectorXd e;
  Eigen::MatrixXd Z, C;

  double logLikelihood(double log_scale) const {
    return logGaussian(e, Eigen::MatrixXd(Z + std::exp(2.0 * log_scale) * C));
  }
};

DriftScale::Joint DriftScale::joint(const std::vector<Measured>& loops,
                                    const std::vector<int>& parts) const {
  const auto size = static_cast<Eigen::Index>(parts.size());
  const auto n = static_cast<Eigen::Index>(loops.size()) * size;
  Joint all{Eigen::VectorXd(n), Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index i = 0; i * size < n; ++i) {
    const Measured& x = loops[static_cast<std::size_t>(i)];
    all.e.segment(i * size, size) = x.error(parts);
    all.Z.block(i * size, i * size, size, size) = x.covariance(parts, parts);
    for (Eigen::Index j = 0; j * size < n; ++j) {
      const Eigen::Matrix4d shared = sharedError(x, loops[static_cast<std::size_t>(j)]);
      all.C.block(i * size, j * size, size, size) = shared(parts, parts);
    }
  }
  return all;
}

/// Returns the logarithm of the probability density of the loops, integrated over the scale.
double DriftScale::logEvidence(const std::vector<Measured>& loops) const {
  constexpr std::size_t kEach = 2;  // a coarse grid suffices here
  const Joint all = joint(loops, kPlane);
  std::vector<double> terms;
  for (std::size_t k = 0; k < log_scales_.size(); k += kEach) {
    terms.push_back(plane_[k] + all.logLikelihood(log_scales_[k]));
  }
  const double peak = *std::max_element(terms.begin(), terms.end());
  if (!std::isfinite(peak)) return -std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (const double term : terms) sum += std::exp(term - peak);
  return peak + std::log(sum);
}

/// Removes loops that are more probably wrong than right, given the others.
void DriftScale::dropWrong(std::vector<Measured>& loops) const {
  // The error of a wrong loop is uniform over 10 m in x and y and 0.2 rad in yaw.
  const double wrong = std::log(0.05 / 0.95) + std::log(1.0 / (10.0 * 10.0 * 0.2));
  double evidence = logEvidence(loops);
  while (loops.size() > 1) {
    std::optional<std::size_t> worst;
    double best = evidence;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      std::vector<Measured> others = loops;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const double without = logEvidence(others) + wrong;
      if (without <= best) continue;
      best = without;
      worst = i;
    }
    if (!worst) return;
    loops.erase(loops.begin() + static_cast<std::ptrdiff_t>(*worst));
    evidence = best - wrong;
  }
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
  std::vector<Measured> used;
  for (auto& [stretch, measured] : best) used.push_back(std::move(measured));
  dropWrong(used);
  const Joint plane = joint(used, kPlane), height = joint(used, {2});
  for (std::size_t k = 0; k < log_scales_.size(); ++k) {
    plane_[k] += plane.logLikelihood(log_scales_[k]);
    height_[k] += height.logLikelihood(log_scales_[k]);
  }
  return true;
}

DriftVariance DriftScale::variance(double quantile) const {
  return {varianceOf(plane_, quantile), varianceOf(height_, quantile)};
}

double DriftScale::varianceOf(const LogPosterior& log_posterior, double quantile) const {
  const double peak = *std::max_element(log_posterior.begin(), log_posterior.end());
  if (!std::isfinite(peak)) return 1.0;
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

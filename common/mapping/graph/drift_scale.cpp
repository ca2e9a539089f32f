#include "common/mapping/graph/drift_scale.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

constexpr double kLeast = 0.02, kMost = 8.0;
constexpr int kSteps = 48;

}  // namespace

DriftScale::DriftScale(const DriftScaleParameters& parameters) : quantile_(parameters.quantile) {
  for (int i = 0; i <= kSteps; ++i) {
    const double log_scale = std::log(kLeast) + (std::log(kMost) - std::log(kLeast)) * i / kSteps;
    const double d = log_scale / parameters.prior_sigma;
    log_scales_.push_back(log_scale);
    plane_.push_back(-0.5 * d * d);
  }
  height_ = plane_;
}

void DriftScale::add(const Eigen::Vector4d& error, const Eigen::Matrix4d& measured,
                     const Eigen::Matrix4d& odometry) {
  const Eigen::Vector3i plane(0, 1, 3);
  for (std::size_t i = 0; i < log_scales_.size(); ++i) {
    const Eigen::Matrix4d covariance = measured + std::exp(2.0 * log_scales_[i]) * odometry;
    plane_[i] +=
        logGaussian(Eigen::Vector3d(error(plane)), Eigen::Matrix3d(covariance(plane, plane)));
    height_[i] += logGaussian(error.segment<1>(2), covariance.block<1, 1>(2, 2));
  }
}

DriftVariance DriftScale::variance() const { return {varianceOf(plane_), varianceOf(height_)}; }

double DriftScale::varianceOf(const LogPosterior& log_posterior) const {
  const double peak = *std::max_element(log_posterior.begin(), log_posterior.end());
  double all = 0.0;
  for (const double l : log_posterior) all += std::exp(l - peak);
  double sum = 0.0;
  for (std::size_t i = 0; i < log_scales_.size(); ++i) {
    sum += std::exp(log_posterior[i] - peak);
    if (sum >= quantile_ * all) return std::exp(2.0 * log_scales_[i]);
  }
  return std::exp(2.0 * log_scales_.back());
}

}  // namespace perdure::mapping

#include "services/semantic_filter/core/belief/classes/upper_part.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"

namespace perdure::semantic_filter {
namespace {

constexpr int kLength = 0, kWidth = 1, kHeight = 2;  // indices of log(l, w, h)

struct LogExtent {
  double mean, variance;
};

/// Returns the usual log length (`which` = kLength) or log height of an object of this width.
LogExtent usual(int which, const Hypothesis& h, const ClassPrior& prior) {
  const Eigen::Matrix3d& P = prior.log_size_covariance;
  const double gain = P(which, kWidth) / P(kWidth, kWidth);
  const double wider = h.x[kSize + kWidth] - prior.log_size[kWidth];
  return {prior.log_size[which] + gain * wider,
          std::max(P(which, which) - gain * P(which, kWidth), 1e-6)};
}

/// Returns the moments of a Gaussian that is truncated to values above `least`.
LogExtent above(const LogExtent& usual, double least) {
  constexpr double kFarAbove = 5.0;  // deviations; the density is then nearly exponential
  const double sigma = std::sqrt(usual.variance);
  const double a = std::min((least - usual.mean) / sigma, kFarAbove);
  const double density = std::exp(-0.5 * a * a) / std::sqrt(2.0 * M_PI);
  const double ratio = density / (0.5 * std::erfc(a / std::sqrt(2.0)));
  return {std::max(usual.mean + sigma * ratio, least),
          usual.variance * std::max(1.0 + a * ratio - ratio * ratio, 1e-3)};
}

}  // namespace

SizePrior sizePriorOf(const ClassPrior& prior, bool upper_part) {
  SizePrior size{prior.log_size, prior.log_size_covariance};
  if (!upper_part) return size;
  for (const int which : {kLength, kHeight}) {  // the log of a uniform share: mean -1, variance 1
    size.mean[which] -= 1.0;
    size.covariance(which, which) += 1.0;
  }
  size.mean[kHeight] -= std::log(2.0);
  return size;
}

bool lessThanHalf(const Hypothesis& h, const ClassPrior& prior) {
  return h.x[kSize + kHeight] < usual(kHeight, h, prior).mean - std::log(2.0);
}

Hypothesis wholeOf(const Hypothesis& h, const ClassPrior& prior) {
  if (!h.upper_part) return h;
  constexpr int kLogLength = kSize + kLength, kLogHeight = kSize + kHeight;
  const LogExtent length = above(usual(kLength, h, prior), h.x[kLogLength]);
  const LogExtent height = above(usual(kHeight, h, prior), h.x[kLogHeight]);
  const double seen_m = std::exp(h.x[kLogHeight]), whole_m = std::exp(height.mean);
  Hypothesis whole = h;
  whole.upper_part = false;
  whole.x[2] += 0.5 * (seen_m - whole_m);
  whole.x[kLogLength] = length.mean;
  whole.x[kLogHeight] = height.mean;
  StateCovariance A = StateCovariance::Identity();
  A(2, kLogHeight) = 0.5 * seen_m;
  A(kLogLength, kLogLength) = A(kLogHeight, kLogHeight) = 0.0;
  State by_height = State::Zero();
  by_height[2] = -0.5 * whole_m;
  by_height[kLogHeight] = 1.0;
  // The part may be at the front of the object, in its middle or at its back.
  State along = State::Zero();
  along.head<2>() = 0.5 * (std::exp(length.mean) - std::exp(h.x[kLogLength])) *
                    Eigen::Vector2d(std::cos(h.x[kYaw]), std::sin(h.x[kYaw]));
  whole.P = A * h.P * A.transpose() + height.variance * by_height * by_height.transpose() +
            along * along.transpose();
  whole.P(kLogLength, kLogLength) += length.variance;
  makeSymmetric(whole.P);
  whole.C = A * h.C;
  return whole;
}

}  // namespace perdure::semantic_filter

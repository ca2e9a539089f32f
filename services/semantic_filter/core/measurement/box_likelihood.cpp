#include "services/semantic_filter/core/measurement/box_likelihood.h"

#include <algorithm>
#include <cmath>

#include "common/math/chi2.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"

namespace perdure::semantic_filter {
namespace {

/// Returns log P(X < 0) for X ~ N(mean, variance).
double logBelowZero(double mean, double variance) {
  return std::log(std::max(0.5 * std::erfc(mean / std::sqrt(2.0 * variance)), 1e-12));
}

/// Returns the log of the t density in n dimensions, from the squared Mahalanobis distance `nis`.
double logStudent(double nis, double log_det, int n, double tail) {
  thread_local double cached_tail = -1.0;
  thread_local std::array<double, 5> constant{};  // for 1 to 4 dimensions
  if (cached_tail != tail) {
    for (int i = 1; i <= 4; ++i) {
      constant[i] =
          std::lgamma(0.5 * (tail + i)) - std::lgamma(0.5 * tail) - 0.5 * i * std::log(tail * M_PI);
    }
    cached_tail = tail;
  }
  return constant[n] - 0.5 * log_det - 0.5 * (tail + n) * std::log1p(nis / tail);
}

/// Returns the χ² quantile of the gate for 1 to 4 degrees of freedom. It is computed once.
double gateThreshold(double gate, int dof) {
  thread_local double cached_gate = -1.0;
  thread_local std::array<double, 5> quantile{};
  if (cached_gate != gate) {
    for (int i = 1; i <= 4; ++i) quantile[i] = chi2Quantile(gate, i);
    cached_gate = gate;
  }
  return quantile[dof];
}

/// Returns the distance of the predicted side inside the observed one, px. The true side lies at or
/// beyond a censored side: left and top at smaller coordinates, right and bottom at larger ones.
double within(const BoxMeasurement& z, const ProjectedBox& predicted, int side) {
  const double d = predicted.sides[side] - z.sides[side];
  return side < 2 ? d : -d;
}

using Sides = std::array<bool, 4>;

/// Whether one side alone is outside the gate.
bool outsideOf(double gate, const BoxMeasurement& z, const ProjectedBox& predicted,
               const Eigen::Matrix4d& covariance, int side) {
  const double nu = z.sides[side] - predicted.sides[side];
  return nu * nu > gate * (covariance(side, side) + z.variance[side]);
}

/// Scores the sides in use. The others count with the probability that the true side lies beyond.
/// Returns nothing outside the gate.
std::optional<BoxScore> scoreSides(const BoxMeasurement& z, const ProjectedBox& predicted,
                                   const Eigen::Matrix4d& covariance, const Sides& use,
                                   const BoxParameters& parameters) {
  BoxScore score;
  score.dof = static_cast<int>(std::count(use.begin(), use.end(), true));
  if (score.dof == 0) return std::nullopt;
  const double gate = gateThreshold(parameters.gate, score.dof);
  Eigen::Vector4d nu = Eigen::Vector4d::Zero();
  Eigen::Matrix4d S = covariance;
  S.diagonal() += z.variance;
  for (int i = 0; i < 4; ++i) {
    if (!use[i]) continue;
    if (outsideOf(gate, z, predicted, covariance, i)) return std::nullopt;
    nu[i] = z.sides[i] - predicted.sides[i];
  }
  // Sides that are not compared keep their rows, with a residual of 0 and a variance of 1.
  for (int i = 0; i < 4; ++i) {
    if (use[i]) continue;
    S.row(i).setZero();
    S.col(i).setZero();
    S(i, i) = 1.0;
  }
  if (!choleskyInPlace(S)) return std::nullopt;
  whiten(S, nu);
  score.nis = nu.squaredNorm();
  if (score.nis > gate) return std::nullopt;
  for (int i = 0; i < 4; ++i) {
    if (use[i] || !predicted.exact[i]) continue;
    const double variance = std::max(covariance(i, i), 0.0) + z.variance[i];
    score.log_density += logBelowZero(within(z, predicted, i), variance);
  }
  score.log_density +=
      logStudent(score.nis, 2.0 * std::log(S.diagonal().prod()), score.dof, parameters.tail);
  return score;
}

/// Returns the log density of a hidden side, which may lie anywhere within the object.
double logAnywhere(const ProjectedBox& predicted, int side) {
  const int axis = side % 2;
  return -std::log(std::max(predicted.sides[axis + 2] - predicted.sides[axis], 1.0));
}

/// Returns the sides in use that may be hidden. Each lies inside the predicted side, and no other
/// side alone is outside the gate.
Sides mayBeHidden(const BoxMeasurement& z, const ProjectedBox& predicted,
                  const Eigen::Matrix4d& covariance, const Sides& use,
                  const BoxParameters& parameters) {
  Sides result{}, outside{};
  const auto compared = static_cast<int>(std::count(use.begin(), use.end(), true));
  if (compared < 3) return result;
  const double gate = gateThreshold(parameters.gate, compared - 1);
  for (int i = 0; i < 4; ++i) {
    outside[i] = use[i] && outsideOf(gate, z, predicted, covariance, i);
  }
  const auto all_outside = std::count(outside.begin(), outside.end(), true);
  for (int i = 0; i < 4; ++i) {
    result[i] = use[i] && all_outside == (outside[i] ? 1 : 0) && within(z, predicted, i) < 0.0;
  }
  return result;
}

void keepLikelier(std::optional<BoxScore>& best, const std::optional<BoxScore>& next,
                  double log_share) {
  if (!next || (best && best->log_density >= next->log_density + log_share)) return;
  best = next;
  best->log_density += log_share;
}

}  // namespace

int BoxMeasurement::count() const {
  return static_cast<int>(std::count(measured.begin(), measured.end(), true));
}

SideError sideError(const BoxParameters& parameters, const BoxNoise& noise) {
  return {std::max(parameters.sigma_px, parameters.sigma_network_px * noise.pixel),
          noise.relative > 0.0 ? noise.relative : parameters.sigma_relative};
}

SideError lastingError(const BoxParameters& parameters, const BoxNoise& noise) {
  return sideError(parameters, noise) * std::sqrt(parameters.bias_share);
}

BoxMeasurement measure(const Box& box, double width, double height, const BoxParameters& parameters,
                       const BoxNoise& noise) {
  BoxMeasurement z;
  z.sides << std::clamp(box.x1, 0.0, width), std::clamp(box.y1, 0.0, height),
      std::clamp(box.x2, 0.0, width), std::clamp(box.y2, 0.0, height);
  const SideError lasting = lastingError(parameters, noise);
  SideError error = sideError(parameters, noise);
  error.relative += parameters.sigma_weak * noise.clutter_probability;
  const double sx = error.at(z.width()), sy = error.at(z.height());
  for (int i = 0; i < 4; ++i) {
    const bool is_x = i % 2 == 0;
    const double whole = noise.sides[i] > 0.0 ? noise.sides[i] : is_x ? sx : sy;
    const double stays = lasting.at(is_x ? z.width() : z.height());
    z.lasting[i] = std::min(stays * stays, parameters.bias_share * whole * whole);
    z.variance[i] = whole * whole - z.lasting[i];
  }
  const double mx = std::max(parameters.border_px, sx), my = std::max(parameters.border_px, sy);
  z.measured = {z.sides[0] > mx, z.sides[1] > my, z.sides[2] < width - mx,
                z.sides[3] < height - my};
  return z;
}

Eigen::Vector4d biasSigma(const SideError& lasting, double width_px, double height_px) {
  const double x = lasting.at(width_px) / width_px, y = lasting.at(height_px) / height_px;
  return {x, y, x, y};
}

double logClutter(const BoxMeasurement& z, double width, double height,
                  const ClutterParameters& parameters, const std::array<bool, 4>& ignored) {
  const double size[2] = {std::max(z.width(), 1.0), std::max(z.height(), 1.0)};
  const double extent[2] = {width, height};
  double log_measure = std::log(parameters.per_frame);
  for (int axis = 0; axis < 2; ++axis) {
    const int censored = !z.measured[axis] + !z.measured[axis + 2];
    const double log_uniform = std::log(std::log(extent[axis] / parameters.min_size_px));
    const int told = 2 - censored - ignored[axis] - ignored[axis + 2];
    if (told > 0) log_measure -= std::log(extent[axis]);
    if (told == 2) log_measure -= std::log(size[axis]) + log_uniform;
    log_measure += censored * std::log(parameters.censored_probability);
  }
  return log_measure;
}

Eigen::Matrix4d predictedCovariance(const Hypothesis& h, const ProjectedBox& box,
                                    const Eigen::Matrix<double, 6, 6>& P_pose) {
  // No side depends on the velocity.
  const Eigen::Matrix<double, 4, kVelocity> H = box.H.leftCols<kVelocity>();
  const auto HP = timesTop<kVelocity>(H, h.P);
  const Eigen::Matrix<double, 4, 6> pose =
      timesTop<6>(H, h.C) + 0.5 * timesTop<6>(box.H_pose, P_pose);
  const Eigen::Matrix4d half = 0.5 * timesTransposed(HP, H) + timesTransposed(pose, box.H_pose);
  return half + half.transpose();
}

bool mayOverlap(const BoxMeasurement& z, const ProjectedBox& p, const Eigen::Matrix4d& covariance) {
  constexpr double kReach = 5.0;  // deviations
  for (int axis = 0; axis < 2; ++axis) {
    const double gap =
        std::max(z.sides[axis] - p.sides[axis + 2], p.sides[axis] - z.sides[axis + 2]);
    if (gap <= 0.0) continue;
    const double variance = std::max(covariance(axis, axis), covariance(axis + 2, axis + 2));
    if (gap * gap > kReach * kReach * (variance + z.variance[axis])) return false;
  }
  return true;
}

std::array<bool, 4> comparableSides(const BoxMeasurement& z, const ProjectedBox& predicted,
                                    const std::array<bool, 4>& hidden) {
  std::array<bool, 4> use;
  for (int i = 0; i < 4; ++i) use[i] = z.measured[i] && !hidden[i] && predicted.exact[i];
  return use;
}

std::optional<BoxScore> scoreBox(const BoxMeasurement& z, const ProjectedBox& predicted,
                                 const Eigen::Matrix4d& covariance,
                                 const std::array<bool, 4>& hidden,
                                 const BoxParameters& parameters) {
  Sides use = comparableSides(z, predicted, hidden), whole = use, ignored{};
  double log_shown = 0.0;
  for (int i = 0; i < 4; ++i) {
    if (!z.measured[i] || use[i]) continue;
    if (predicted.exact[i]) {
      whole[i] = true;
      log_shown += logAnywhere(predicted, i);
      continue;
    }
    // An object that passes behind the camera reaches at least as far as predicted.
    use[i] = whole[i] = !hidden[i] && within(z, predicted, i) < 0.0;
    ignored[i] = !use[i];
  }
  std::optional<BoxScore> best;
  bool fits = false;
  const auto consider = [&](const Sides& sides, double log_share, int part) {
    auto score = scoreSides(z, predicted, covariance, sides, parameters);
    if (!score) return;
    fits = fits || score->nis < gates::kWholeView;
    score->part = part;
    keepLikelier(best, score, log_share);
  };
  if (whole != use) {
    consider(whole, std::log(parameters.amodal), -1);
    log_shown += std::log(1.0 - parameters.amodal);
  }
  consider(use, log_shown, -1);
  const Sides parts = fits || parameters.partial_view <= 0.0
                          ? Sides{}
                          : mayBeHidden(z, predicted, covariance, use, parameters);
  for (int i = 0; i < 4 && !fits; ++i) {
    if (!parts[i]) continue;
    Sides others = use;
    others[i] = false;
    // An unmapped object hides each of the four sides with the same probability.
    consider(others,
             log_shown + std::log(0.25 * parameters.partial_view) + logAnywhere(predicted, i), i);
  }
  if (best) best->ignored = ignored;
  return best;
}

}  // namespace perdure::semantic_filter

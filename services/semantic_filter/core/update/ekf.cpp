#include "services/semantic_filter/core/update/ekf.h"

#include <algorithm>

#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {

namespace {

using SideRows = Eigen::Matrix<double, 4, kVelocity>;  // no side depends on the velocity
using Gains = Eigen::Matrix<double, kStateDim, 4>;

/// Innovation of the four sides. A side that is not used has zero residual and zero rows.
struct Innovation {
  Eigen::Vector4d residual = Eigen::Vector4d::Zero(), variance = Eigen::Vector4d::Ones();
  SideRows H = SideRows::Zero();
  Eigen::Matrix<double, 4, 6> H_pose = Eigen::Matrix<double, 4, 6>::Zero();
  int count = 0;
};

/// Returns the innovation of comparable sides, and of other sides whose prediction ends inside the
/// box.
Innovation innovation(const BoxMeasurement& z, const ProjectedBox& p,
                      const std::array<bool, 4>& hidden) {
  Innovation y;
  const auto use = comparableSides(z, p, hidden);
  for (int i = 0; i < 4; ++i) {
    const double inside = i < 2 ? p.sides[i] - z.sides[i] : z.sides[i] - p.sides[i];
    if (!use[i] && !(p.exact[i] && inside > 0.0)) continue;
    y.residual[i] = z.sides[i] - p.sides[i];
    y.variance[i] = z.variance[i];
    y.H.row(i) = p.H.row(i).head<kVelocity>();
    y.H_pose.row(i) = p.H_pose.row(i);
    ++y.count;
  }
  return y;
}

/// K = W L⁻¹ with S = L Lᵀ and W = (P Hᵀ + C H_gᵀ) L⁻ᵀ, so that K S Kᵀ = W Wᵀ.
struct Gain {
  Gains W;
  Eigen::Matrix4d L;
};

/// Returns nothing if S is not positive definite. `PHt`: P Hᵀ + C H_gᵀ. `S`: without the noise.
/// `variance`: of the noise.
std::optional<Gain> gainOf(const Gains& PHt, const Eigen::Matrix4d& S,
                           const Eigen::Vector4d& variance) {
  Gain gain{PHt, S};
  gain.L.diagonal() += variance;
  if (!choleskyInPlace(gain.L)) return std::nullopt;
  whitenRows(gain.L, gain.W);
  return gain;
}

/// Returns the factor on the noise of an outlier: the inverse weight of a t distribution.
double inflationOf(const Innovation& y, const Eigen::Matrix4d& L, double tail) {
  Eigen::Vector4d whitened = y.residual;
  whiten(L, whitened);
  return std::max(1.0, (tail + whitened.squaredNorm()) / (tail + y.count));
}

}  // namespace

void mix(Hypothesis& none, double share_none, std::vector<Hypothesis>& parts) {
  const bool negligible = share_none <= kNegligible;
  Hypothesis& result = negligible ? parts.front() : none;
  if (!negligible) result.weight = share_none;
  for (Hypothesis& part : parts) {
    if (&part != &result) mergeInto(result, part);
  }
  if (negligible) none = std::move(result);
}

Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repetition,
                         const FrameContext& frame, const ProjectedBox* at_prior) {
  const Matrix6d& P_pose = frame.pose_error.covariance;
  State x = prior.x;
  double inflation = 1.0;
  Eigen::Matrix<double, 4, 6> pose, pose_of_gain;
  std::optional<Gain> gain;
  for (std::int64_t i = 0; i < frame.parameters->box.iterations; ++i) {
    std::optional<ProjectedBox> box;
    if (i > 0 || !at_prior) {
      box = projectObserved(x, frame.projector(), frame.styleOf(prior.class_name), prior.heading());
      if (!box) break;
    }
    Innovation now = innovation(z, box ? *box : *at_prior, hidden);
    if (now.count == 0) break;
    now.variance *= repetition * inflation;
    const Gains PHt = leftTimesTransposed(prior.P, now.H) + timesTransposed(prior.C, now.H_pose);
    pose = timesTop<6>(now.H, prior.C) + timesTop<6>(now.H_pose, P_pose);
    const Eigen::Matrix4d S = timesTop<4>(now.H, PHt) + timesTransposed(now.H_pose, pose);
    auto next_gain = gainOf(PHt, S, now.variance);
    if (i == 0 && next_gain) {
      inflation = inflationOf(now, next_gain->L, frame.parameters->box.tail);
      now.variance *= inflation;
      if (inflation > 1.0) next_gain = gainOf(PHt, S, now.variance);
    }
    if (!next_gain) break;
    State to_prior = prior.x - x;
    to_prior[kYaw] = wrapAngle(to_prior[kYaw]);
    Eigen::Vector4d whitened = now.residual - now.H.lazyProduct(to_prior.head<kVelocity>());
    whiten(next_gain->L, whitened);
    State next = prior.x + next_gain->W * whitened;
    next[kYaw] = wrapAngle(next[kYaw]);
    if (!next.allFinite()) break;
    const double step = (next.head<3>() - x.head<3>()).norm();
    x = next;
    pose_of_gain = pose;
    gain = next_gain;
    if (step < 0.01) break;
  }
  Hypothesis posterior = prior;
  if (!gain) return posterior;
  posterior.x = x;
  posterior.P -= timesTransposed(gain->W, gain->W);
  Eigen::Matrix<double, 6, 4> whitened = pose_of_gain.transpose();
  whitenRows(gain->L, whitened);
  posterior.C -= timesTransposed(gain->W, whitened);
  return posterior;
}

}  // namespace perdure::semantic_filter

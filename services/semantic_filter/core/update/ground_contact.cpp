#include "services/semantic_filter/core/update/ground_contact.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"

namespace perdure::semantic_filter {

namespace {

using Row = Eigen::Matrix<double, 1, kStateDim>;

/// Returns the derivative of the height of the underside by the state.
Row undersideByState(const State& x, const Eigen::Vector3d& up) {
  Row a = Row::Zero();
  a.head<3>() = up.transpose();
  a[kSize + 2] = -0.5 * std::exp(x[kSize + 2]);
  return a;
}

/// Returns the derivative of an estimated height by the pose error, as in addPoseError.
Eigen::Matrix<double, 1, 6> heightByPose(const Eigen::Vector3d& place, const View& view) {
  Eigen::Matrix<double, 1, 6> a;
  const Eigen::Vector3d p_B = view.T_WB.inverse() * place;
  a.head<3>() = -view.up_W.transpose() * view.T_WB.R() * skew(p_B);
  a.tail<3>() = view.up_W.transpose();
  return a;
}

/// Returns the variance of the underside by the boxes alone, given the pose; 0 without parallax.
GroundContact groundContactOf(const Hypothesis& h, const FrameContext& frame) {
  const Matrix6d& P_pose = frame.pose_error.covariance;
  const double distance = (h.x.head<3>() - frame.view.T_WC().p).norm();
  if (placeSigma(h, P_pose) > frame.parameters->ground.resolved * distance) return {};
  const Row a = undersideByState(h.x, frame.view.up_W);
  Eigen::Matrix<double, 1, 6> shared = a * h.C;
  Matrix6d L = P_pose;
  if (choleskyInPlace(L)) {
    whitenRows(L, shared);
  } else {
    shared.setZero();
  }
  return {0.0, std::max(a * h.P * a.transpose() - shared.squaredNorm(), 1e-6)};
}

}  // namespace

double updateWithGround(Hypothesis& h, ObjectId id, const FrameContext& frame) {
  const GroundParameters& p = frame.parameters->ground;
  const double stands = frame.priors->of(h.class_name).stands;
  h.ground_contact = {};
  if (h.upper_part) {  // only the whole object stands on the ground
    Hypothesis whole = wholeOf(h, frame.priors->of(h.class_name));
    return updateWithGround(whole, id, frame);
  }
  if (!frame.ground || stands <= 0.0) return 0.0;
  if (!h.moving) h.ground_contact = groundContactOf(h, frame);
  const auto ground = frame.ground->below(h.x.head<3>(), id);
  if (!ground) return 0.0;
  const Eigen::Vector3d up = frame.view.up_W.normalized();
  const Row a = undersideByState(h.x, up);
  const Eigen::Matrix<double, 1, 6> g = heightByPose(h.x.head<3>(), frame.view);
  const Matrix6d& P_pose = frame.pose_error.covariance;
  const double e = ground->mean - underside(h.x, up);
  const double own = ground->variance + p.sigma_m * p.sigma_m;
  const State with_e = h.C * g.transpose() - h.P * a.transpose();
  const Eigen::Matrix<double, 1, 6> pose_with_e = g * P_pose - a * h.C;
  const double variance = own + (g * P_pose).dot(g) - 2.0 * (a * h.C).dot(g) + (a * h.P).dot(a);
  if (!(variance > own * 0.5)) return 0.0;
  const double density = std::exp(-0.5 * e * e / variance) / std::sqrt(2.0 * M_PI * variance);
  const double on = stands * density, off = (1.0 - stands) / p.span_m;
  const double inlier = on / (on + off);
  if (inlier > 0.5) {
    const double before = underside(h.x, up);
    const double widened = variance + own * (1.0 / inlier - 1.0);
    h.x -= with_e * (e / widened);
    h.x[kYaw] = wrapAngle(h.x[kYaw]);
    h.P -= with_e * with_e.transpose() / widened;
    makeSymmetric(h.P);
    h.C -= with_e * pose_with_e / widened;
    h.ground_contact.above = before - underside(h.x, up);
  }
  return std::log((on + off) * p.span_m);
}

}  // namespace perdure::semantic_filter

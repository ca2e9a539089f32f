#include "services/semantic_filter/core/update/predict.h"

#include <cmath>
#include <utility>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNoWeight = 1e-12;

void predictHypothesis(Hypothesis& h, double dt, const MotionParameters& m) {
  h.x = stateAt(h, dt);
  if (!h.moving) {
    h.P.diagonal().head<3>().array() += m.position_walk * m.position_walk * dt;
    h.P(kYaw, kYaw) += m.yaw_walk * m.yaw_walk * dt;
    return;
  }
  h.P.topRows<3>() += dt * h.P.bottomRows<3>();
  h.P.leftCols<3>() += dt * h.P.rightCols<3>();
  h.C.topRows<3>() += dt * h.C.bottomRows<3>();
  const double q = m.acceleration * m.acceleration;
  for (int i = 0; i < 3; ++i) {
    const double axis_q = i < 2 ? q : 0.01 * q;
    h.P(i, i) += axis_q * dt * dt * dt / 3.0;
    h.P(i, kVelocity + i) += axis_q * dt * dt / 2.0;
    h.P(kVelocity + i, i) += axis_q * dt * dt / 2.0;
    h.P(kVelocity + i, kVelocity + i) += axis_q * dt;
  }
  h.P(kYaw, kYaw) += 25.0 * m.yaw_walk * m.yaw_walk * dt;
}

/// Stationary deviation of b from this view, by the mean extent of the cuboid over all aspects.
Eigen::Vector4d stationaryBias(const State& x, const RigidTransform& T_WC, const ViewWalk& walk) {
  const double scale = walk.focal / std::max((x.head<3>() - T_WC.p).norm(), 1.0);
  const Eigen::Vector3d size = x.segment<3>(kSize).array().exp();
  const double width = std::max(scale * (size.x() + size.y()) * 2.0 / M_PI, 1.0);
  return biasSigma(walk.lasting, width, std::max(scale * size.z(), 1.0));
}

/// b forgets with the change of the view: an Ornstein-Uhlenbeck process along the way. Its pixels
/// become a lesser share of the box as the object comes nearer.
void predictBias(Hypothesis& h, const std::optional<RigidTransform>& last, const ViewWalk& walk) {
  const Eigen::Vector4d sigma = stationaryBias(h.x, walk.T_WC, walk);
  Eigen::Vector4d keep = Eigen::Vector4d::Zero();
  double correlation = 0.0;
  if (last) {
    correlation = std::exp(-viewChange(h.x.head<3>(), *last, walk.T_WC, walk.bias));
    keep = correlation * sigma.cwiseQuotient(stationaryBias(h.x, *last, walk).cwiseMax(1e-12));
  }
  h.x.segment<4>(kBias) = keep.asDiagonal() * h.x.segment<4>(kBias);
  for (int j = 0; j < kStateDim; ++j) h.P.block<4, 1>(kBias, j).array() *= keep.array();
  for (int i = 0; i < 4; ++i) h.P.col(kBias + i) *= keep[i];
  h.C.middleRows<4>(kBias) = (keep.asDiagonal() * h.C.middleRows<4>(kBias)).eval();
  h.P.diagonal().segment<4>(kBias) += (1.0 - correlation * correlation) * sigma.cwiseAbs2();
}

/// That something which stands, and is not on the map, hides it from here. When it comes back into
/// the picture, each look that is remembered from before vouches by itself for the views about its
/// own: what is not found where it was found then is gone rather than screened.
double screenedFromHere(const Object& object, const Eigen::Vector3d& place, const ViewWalk& walk) {
  double screened = walk.screened;
  for (const auto& k : object.keyframes.read()) {
    if (k->from->time >= object.came_back) break;  // they are in order of time
    screened *= 1.0 - std::exp(-viewChange(place, k->from->T_WC, walk.T_WC, walk.screen));
  }
  return screened;
}

/// What may hide it from elsewhere is not known until it is seen from there.
void predictScreen(Object& object, const ViewWalk& walk) {
  const Eigen::Vector3d place = object.best().x.head<3>();
  const double keep = object.last_view
                          ? std::exp(-viewChange(place, *object.last_view, walk.T_WC, walk.screen))
                          : 0.0;
  const double here = screenedFromHere(object, place, walk);
  object.screened = here + keep * (object.screened - here);
  // What drives and is not found is lost rather than seldom found: it would take the boxes of what
  // stands where it was lost.
  object.elusive =
      object.best().moving ? 0.0 : walk.elusive + keep * (object.elusive - walk.elusive);
  object.elusive = std::min(object.elusive, 1.0 - object.screened);
}

/// Whether P - C P_pose⁻¹ Cᵀ / share is positive definite: the usual case, and cheap to see. L_pose
/// is P_pose's Cholesky factor.
bool isExplained(const Hypothesis& h, const Matrix6d& L_pose, double share) {
  CrossPose B = h.C;
  whitenRows(L_pose, B);
  StateCovariance rest = h.P - lowerTimesTransposed(B) / share;
  if (h.moving) return choleskyInPlace(rest);
  Eigen::Matrix<double, kVelocity, kVelocity> still = rest.topLeftCorner<kVelocity, kVelocity>();
  return choleskyInPlace(still);
}

/// [P C; Cᵀ P_pose] must stay a covariance. Transitions are approximate, and vio's own updates
/// shrink P_pose: C is scaled down where the pose would explain more of P than there is. (Much of
/// P may well be the pose: a limit of .9 here costs half of the recall on KITTI.)
void keepConsistent(Hypothesis& h, const Matrix6d& P_pose, const std::optional<Matrix6d>& L_pose) {
  constexpr double kExplained = 0.9999;
  if (h.C.isZero(0.0) || (L_pose && isExplained(h, *L_pose, kExplained))) return;
  const Eigen::Index n = h.moving ? kStateDim : kVelocity;
  const Cholesky P(h.P.topLeftCorner(n, n));
  const Cholesky pose(P_pose);
  if (!P.positive() || !pose.positive()) {
    h.C.setZero();
    return;
  }
  const Eigen::MatrixXd whitened = pose.whiten(P.whiten(h.C.topRows(n)).transpose());
  const double explained = eigenvalues(whitened * whitened.transpose()).maxCoeff();
  if (explained > kExplained) h.C *= std::sqrt(kExplained / explained);
}

/// What drove off unseen could be anywhere: it would claim any box. The object lives on as far as
/// it may have stayed.
void giveUpLostOnes(Object& object, TimePoint now, double lost_sigma_m) {
  double kept = 0.0;
  for (const auto& h : object.hypotheses.read()) {
    const double sigma = std::sqrt(h.P.topLeftCorner<2, 2>().trace());
    if (!h.moving || sigma < lost_sigma_m) kept += h.weight;
  }
  if (kept >= 1.0 - 1e-9) return;
  object.existence.become(object.existence * kept, ExistenceEvidence::kLost, now);
  if (kept <= 1e-9) return;  // nothing is left of it; it will be buried
  std::erase_if(object.hypotheses.write(), [&](const Hypothesis& h) {
    return h.moving && std::sqrt(h.P.topLeftCorner<2, 2>().trace()) >= lost_sigma_m;
  });
  normalise(object, ClassEvidence::kMotion);
}

/// What drives and is not seen turns off, parks or leaves.
void loseMovers(Object& object, double dt, double survival_s) {
  const double stays = std::exp(-dt / survival_s);
  double kept = 0.0;
  for (auto& h : object.hypotheses) {
    if (h.moving) h.weight *= stays;
    kept += h.weight;
  }
  if (kept >= 1.0 - 1e-9 || kept <= 0.0) return;
  object.existence.become(object.existence * kept, ExistenceEvidence::kLost, object.as_of);
  normalise(object, ClassEvidence::kMotion);
}

}  // namespace

std::optional<Matrix6d> transitionBetween(const Matrix6d& earlier, const Matrix6d& later) {
  constexpr double kLargest = 10.0;
  if (earlier == later) return Matrix6d::Identity();
  // Most objects of a frame were brought up to date at the same frame before.
  thread_local Matrix6d product = Matrix6d::Identity(), inverted = Matrix6d::Identity();
  if (earlier != product) {
    product = earlier;
    inverted = inverse(earlier);
  }
  const Matrix6d transition = later.lazyProduct(inverted);
  const bool sane = transition.allFinite() && transition.cwiseAbs().maxCoeff() < kLargest;
  return sane ? std::optional(transition) : std::nullopt;
}

bool hangsTogether(const Hypothesis& h, const Matrix6d& P_pose) {
  if (h.C.isZero(0.0)) return true;
  Matrix6d L = P_pose;
  return choleskyInPlace(L) && isExplained(h, L, 1.0);
}

void stop(Hypothesis& h) {
  const Eigen::Matrix3d S = h.P.bottomRightCorner<3, 3>();
  const Eigen::Matrix<double, kStateDim, 3> K = regressOn(S, h.P.rightCols<3>());
  h.x -= K * Eigen::Vector3d(h.x.tail<3>());
  h.x[kYaw] = wrapAngle(h.x[kYaw]);
  h.P = (h.P - K * S * K.transpose()).eval();
  h.C = (h.C - K * h.C.bottomRows<3>()).eval();
  h.moving = false;
  h.x.tail<3>().setZero();
  h.P.bottomRows<3>().setZero();
  h.P.rightCols<3>().setZero();
  h.C.bottomRows<3>().setZero();
  makeSymmetric(h.P);
}

void letSlowOnesStand(Object& object, double min_speed) {
  const std::size_t count = object.hypotheses.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Hypothesis& moving = object.hypotheses.read()[i];
    if (!moving.moving) continue;
    const double fast = fasterThan(moving, min_speed);
    if (fast > 0.5) continue;
    Hypothesis rest = moving;
    stop(rest);
    rest.weight *= 1.0 - fast;
    object.hypotheses[i].weight *= fast;
    object.hypotheses.push_back(std::move(rest));
  }
  if (object.hypotheses.size() == count) return;
  std::erase_if(object.hypotheses.write(),
                [](const Hypothesis& h) { return h.weight < kNoWeight; });
  normalise(object, ClassEvidence::kMotion);
}

State stateAt(const Hypothesis& h, double dt) {
  State x = h.x;
  if (h.moving) x.head<3>() += dt * h.x.tail<3>();
  return x;
}

Object movedOn(Object object, TimePoint time, const MotionParameters& parameters) {
  const double dt = toSeconds(time - object.as_of);
  if (dt <= 0.0) return object;
  for (auto& h : object.hypotheses) predictHypothesis(h, dt, parameters);
  return object;
}

void predict(Object& object, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk) {
  const double dt = toSeconds(now - object.as_of);
  // Where the transition is lost nothing is left of C.
  const Matrix6d transition =
      transitionBetween(object.pose_product, pose_error.product).value_or(Matrix6d::Zero());
  std::optional<Matrix6d> L_pose = pose_error.covariance;
  if (!choleskyInPlace(*L_pose)) L_pose.reset();
  for (auto& h : object.hypotheses) {
    if (dt > 0.0) predictHypothesis(h, dt, parameters);
    predictBias(h, object.last_view, walk);
    h.C = timesTransposed(h.C, transition);
    keepConsistent(h, pose_error.covariance, L_pose);
  }
  const bool unseen =
      object.last_seen < object.as_of || object.hidden.count + object.away.count > 0;
  if (unseen && dt > 0.0) loseMovers(object, dt, parameters.mover_survival_s);
  giveUpLostOnes(object, now, parameters.lost_sigma_m);
  if (dt > 0.0) {
    object.existence.become(object.existence * std::exp(-dt / parameters.survival_s),
                            ExistenceEvidence::kTime, now);
  }
  if (dt > kAnotherVisit_s && object.away.count > 0 && object.hidden.count == 0) {
    object.came_back = now;
    object.found_rate.beginVisit(walk.screen);
  }
  object.existence.note(ExistenceEvidence::kHidden, std::exchange(object.hidden, {}));
  object.existence.note(ExistenceEvidence::kAway, std::exchange(object.away, {}));
  object.as_of = now;
  predictScreen(object, walk);
  object.last_view = walk.T_WC;
  object.pose_product = pose_error.product;
}

}  // namespace perdure::semantic_filter

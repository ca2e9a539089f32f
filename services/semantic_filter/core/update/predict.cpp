#include "services/semantic_filter/core/update/predict.h"

#include <cmath>
#include <utility>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/visibility/detectability.h"

namespace perdure::semantic_filter {

namespace {

/// Returns the stationary deviation of b in this view, for the mean width over all directions.
Eigen::Vector4d stationaryBias(const State& x, const RigidTransform& T_WC, const ViewWalk& walk) {
  const double scale = walk.focal / std::max((x.head<3>() - T_WC.p).norm(), 1.0);
  const Eigen::Vector3d size = x.segment<3>(kSize).array().exp();
  const double width = std::max(scale * (size.x() + size.y()) * 2.0 / M_PI, 1.0);
  return biasSigma(walk.lasting, width, std::max(scale * size.z(), 1.0));
}

/// Predicts b: an Ornstein-Uhlenbeck process along the view change, relative to the box's size.
void predictBias(Hypothesis& h, const std::optional<RigidTransform>& last, const ViewWalk& walk) {
  const Eigen::Vector4d sigma = stationaryBias(h.x, walk.T_WC, walk);
  Eigen::Vector4d keep = Eigen::Vector4d::Zero();
  double correlation = 0.0;
  if (last) {
    correlation = viewCorrelation(h.x.head<3>(), *last, walk.T_WC, walk.bias);
    keep = correlation * sigma.cwiseQuotient(stationaryBias(h.x, *last, walk).cwiseMax(1e-12));
  }
  h.x.segment<4>(kBias) = keep.asDiagonal() * h.x.segment<4>(kBias);
  for (int j = 0; j < kStateDim; ++j) h.P.block<4, 1>(kBias, j).array() *= keep.array();
  for (int i = 0; i < 4; ++i) h.P.col(kBias + i) *= keep[i];
  h.C.middleRows<4>(kBias) = (keep.asDiagonal() * h.C.middleRows<4>(kBias)).eval();
  h.P.diagonal().segment<4>(kBias) += (1.0 - correlation * correlation) * sigma.cwiseAbs2();
}

/// Removes moving hypotheses whose position is lost, because they would explain any box. Existence
/// is multiplied by the share of the others.
void dropLostHypotheses(Track& track, TimePoint now, double lost_sigma_m) {
  double kept = 0.0;
  for (const auto& h : track.hypotheses.read()) {
    const double sigma = std::sqrt(h.P.topLeftCorner<2, 2>().trace());
    if (!h.moving || sigma < lost_sigma_m) kept += h.weight;
  }
  if (kept >= 1.0 - 1e-9) return;
  track.existence.become(track.existence * kept, ExistenceEvidence::kLost, now);
  if (kept <= 1e-9) return;  // the track will be deleted
  std::erase_if(track.hypotheses.write(), [&](const Hypothesis& h) {
    return h.moving && std::sqrt(h.P.topLeftCorner<2, 2>().trace()) >= lost_sigma_m;
  });
  normalise(track, ClassEvidence::kMotion);
}

/// Lowers the weights of moving hypotheses and the existence, because an undetected moving object
/// may turn off, park or leave.
void decayUndetectedMoving(Track& track, double dt, double survival_s) {
  const double stays = std::exp(-dt / survival_s);
  double kept = 0.0;
  for (auto& h : track.hypotheses) {
    if (h.moving) h.weight *= stays;
    kept += h.weight;
  }
  if (kept >= 1.0 - 1e-9 || kept <= 0.0) return;
  track.existence.become(track.existence * kept, ExistenceEvidence::kLost, track.as_of);
  normalise(track, ClassEvidence::kMotion);
}

}  // namespace

void predict(Track& track, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk) {
  const double dt = toSeconds(now - track.as_of);
  // Without a usable transition C becomes 0.
  const Matrix6d transition =
      transitionBetween(track.pose_product, pose_error.product).value_or(Matrix6d::Zero());
  const bool may_disagree = pose_error.reported || track.life.recalled;
  std::optional<Matrix6d> L_pose;
  if (may_disagree) L_pose = pose_error.covariance;
  if (L_pose && !choleskyInPlace(*L_pose)) L_pose.reset();
  for (auto& h : track.hypotheses) {
    if (dt > 0.0) predictHypothesis(h, dt, parameters);
    predictBias(h, track.views.predicted_from, walk);
    h.C = timesTransposed(h.C, transition);
    if (may_disagree) keepConsistent(h, pose_error.covariance, L_pose);
  }
  const bool undetected = track.life.last_seen < track.as_of || track.unused.count() > 0;
  if (undetected && dt > 0.0) decayUndetectedMoving(track, dt, parameters.mover_survival_s);
  dropLostHypotheses(track, now, parameters.lost_sigma_m);
  if (dt > 0.0) {
    track.existence.become(track.existence * std::exp(-dt / parameters.survival_s),
                           ExistenceEvidence::kTime, now);
  }
  if (dt > kAnotherVisit_s && track.unused.out_of_view.count > 0 &&
      track.unused.occluded.count == 0) {
    track.life.visit_began = now;
    track.detectability.rate.beginVisit(walk.detectability);
    track.detectability.seen_from =
        track.detectability.seen_from.cwiseMax(track.detectability.seen_now);
    track.detectability.seen_now.setZero();
  }
  track.existence.note(ExistenceEvidence::kHidden, std::exchange(track.unused.occluded, {}));
  track.existence.note(ExistenceEvidence::kAway, std::exchange(track.unused.out_of_view, {}));
  track.as_of = now;
  predictDetectability(track, walk);
  track.views.predicted_from = walk.T_WC;
  track.pose_product = pose_error.product;
}

}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/belief/track_message.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/algorithms/stable_sort.h"
#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

namespace {

/// Makes P positive definite, because readers refuse other messages. Rounding may leave a pivot
/// just below zero. Smaller eigenvalues of the correlations are raised to kLeastEigenvalue.
Matrix7d definite(const Matrix7d& P) {
  constexpr double kLeastEigenvalue = 1e-9;  // of the correlations; also least variance, m² or rad²
  constexpr double kRounding = 1e-12;
  Matrix7d L = P;
  // A reader checks the correlations: their pivots are the pivots of P over its variances.
  if (choleskyInPlace(L) &&
      (L.diagonal().array().square() > kRounding * P.diagonal().array()).all()) {
    return P;
  }
  const Vector7d sigma = P.diagonal().cwiseMax(kLeastEigenvalue).cwiseSqrt();
  const Vector7d inverse = sigma.cwiseInverse();
  const Matrix7d correlations = inverse.asDiagonal() * P * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix7d> parts(correlations);
  const Matrix7d& V = parts.eigenvectors();
  const Vector7d values = parts.eigenvalues().cwiseMax(kLeastEigenvalue);
  Matrix7d result =
      sigma.asDiagonal() * (V * values.asDiagonal() * V.transpose()) * sigma.asDiagonal();
  makeSymmetric(result);
  return result;
}

/// Writes the mean of the heaviest hypothesis of a class, and the second moments about it of all
/// hypotheses of the class with the same motion.
void toClassBelief(const Track& track, const ClassPrior& prior, const std::string& name,
                   ClassBelief& belief) {
  belief.name = name;
  belief.probability = 0.0;
  std::optional<Hypothesis> heaviest;
  Matrix7d moments = Matrix7d::Zero();
  Eigen::Matrix<double, 7, 6> cross = Eigen::Matrix<double, 7, 6>::Zero();
  double weight = 0.0;
  for (const auto& of_track : track.hypotheses) {
    if (of_track.class_name != name) continue;
    const Hypothesis h = wholeOf(of_track, prior);
    belief.probability += h.weight;
    if (!heaviest) heaviest = h;
    if (h.moving != heaviest->moving) continue;
    const Vector7d d = geometryDifference(h, *heaviest);
    moments += h.weight * (h.P.topLeftCorner<7, 7>() + d * d.transpose());
    cross += h.weight * h.C.topRows<7>();
    weight += h.weight;
  }
  belief.mean = heaviest->x.head<7>();
  belief.covariance = definite(moments / weight);
  if (name == kOtherClass && !heaviest->modes_searched) {
    // variance of an unknown yaw, modulo 180°
    constexpr double kAnyYaw = M_PI * M_PI / 12.0;
    belief.covariance(kYaw, kYaw) = std::max(belief.covariance(kYaw, kYaw), kAnyYaw);
  }
  belief.cross_pose = cross / weight;
}

}  // namespace

void toBelief(const Track& track, const ClassPriors& priors, double min_speed,
              ObjectBelief& belief) {
  belief.id = track.id;
  belief.track = 0;
  belief.existence = track.existence;
  belief.confirmed = track.life.confirmed;
  ScratchVector<const std::string*> names;
  names.reserve(track.hypotheses.size());
  for (const auto& h : track.hypotheses) {
    const auto same = [&](const std::string* name) { return *name == h.class_name; };
    if (std::none_of(names.begin(), names.end(), same)) names.push_back(&h.class_name);
  }
  belief.classes.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i)
    toClassBelief(track, priors.of(*names[i]), *names[i], belief.classes[i]);
  const auto likelier = [](const auto& a, const auto& b) { return a.probability > b.probability; };
  if (!std::is_sorted(belief.classes.begin(), belief.classes.end(), likelier)) {
    stableSortBy(belief.classes, [](const ClassBelief& c) { return -c.probability; });
  }
  belief.visibility = track.visibility.state;
  belief.visible_fraction = track.visibility.fraction;
  belief.blocked_by = track.visibility.blocked_by;
  belief.first_seen = track.life.first_seen;
  belief.last_seen = track.life.last_seen;
  belief.as_of = track.as_of;
  belief.hits = track.life.hits;
  belief.visible_misses = track.life.visible_misses;
  belief.moving = movingProbability(track, min_speed);
  const bool moves = track.best().moving;
  belief.velocity = moves ? Eigen::Vector3d(track.best().x.tail<3>()) : Eigen::Vector3d::Zero();
  belief.memory = Memory::kWorking;
  belief.recalled = track.life.recalled;
  belief.seen_from = track.detectability.seen_from.cwiseMax(track.detectability.seen_now);
  const auto& entries = track.existence.entries();
  belief.why.existence.assign(entries.begin(), entries.end());
  track.classes.publish(belief.why);
}

ObjectBelief toBelief(const Track& track, const ClassPriors& priors, double min_speed) {
  ObjectBelief belief;
  toBelief(track, priors, min_speed, belief);
  return belief;
}

Track fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product, ExistenceEvidence back) {
  Track track;
  track.id = belief.trackId();
  track.existence = {belief.existence, belief.why.existence, back, belief.as_of};
  track.classes = {belief.why.classes, belief.why.ousted};
  track.life.confirmed = belief.confirmed;
  track.life.once_confirmed = belief.confirmed || back == ExistenceEvidence::kRecall;
  for (const auto& c : belief.classes) {
    Hypothesis h;
    h.class_name = c.name;
    h.weight = c.probability;
    h.x.head<7>() = c.mean;
    h.P.setZero();
    h.P.topLeftCorner<7, 7>() = c.covariance;
    h.C.topRows<7>() = c.cross_pose;
    h.moving = belief.moving > 0.5;
    if (h.moving) {
      h.x.tail<3>() = belief.velocity;
      h.P.diagonal().tail<3>().setConstant(1.0);  // (1 m/s)²; the message has none
    }
    track.hypotheses.push_back(h);
  }
  track.life.first_seen = belief.first_seen;
  track.life.last_seen = belief.last_seen;
  track.as_of = belief.as_of;
  track.pose_product = pose_product;
  track.life.hits = belief.hits;
  track.life.visible_misses = belief.visible_misses;
  track.visibility.state = belief.visibility;
  track.visibility.fraction = belief.visible_fraction;
  track.visibility.blocked_by = belief.blocked_by;
  track.life.recalled = true;
  track.detectability.seen_from = belief.seen_from;
  track.batch.complete = false;
  normalise(track, ClassEvidence::kRestore);
  return track;
}

}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/tracks/lifecycle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

template <int N>
double deviation2(const Eigen::Matrix<double, N, 1>& d, const Eigen::Matrix<double, N, N>& P) {
  Eigen::Matrix<double, N, N> L = P;
  if (!choleskyInPlace(L)) return std::numeric_limits<double>::infinity();
  Eigen::Matrix<double, N, 1> whitened = d;
  whiten(L, whitened);
  return whitened.squaredNorm();
}

bool hasMoving(const Object& object) {
  return std::any_of(object.hypotheses.begin(), object.hypotheses.end(),
                     [](const auto& h) { return h.moving; });
}

void settleSlowOnes(Object& object, double min_speed) {
  if (!hasMoving(object)) return;
  for (auto& h : object.hypotheses) {
    if (!h.moving) continue;
    const Eigen::Matrix2d P = h.P.block<2, 2>(kVelocity, kVelocity);
    const double sigma = std::sqrt(std::max(P.trace(), 0.0));
    if (h.x.segment<2>(kVelocity).norm() + sigma > min_speed) continue;
    stop(h);
  }
}

/// What moves seldom creeps: the Gaussian prior of a moving one's velocity has a hole around zero.
/// Without it a parked car of unusual size is one of usual size that creeps.
void weighPace(Object& object, const ClassPriors& priors, const MotionParameters& motion) {
  if (!hasMoving(object)) return;
  for (auto& h : object.hypotheses) {
    if (!h.moving) continue;
    const double slow = motion.slow_share * priors.of(h.class_name).speed_sigma;
    const double pace = motion.creeping + (1.0 - motion.creeping) * fasterThan(h, slow);
    h.weight *= pace / h.pace;
    h.pace = pace;
  }
}

/// Two beliefs about one place of very different certainty are two explanations.
bool wider(const Hypothesis& a, const Hypothesis& b) {
  const double va = a.P.topLeftCorner<3, 3>().trace(), vb = b.P.topLeftCorner<3, 3>().trace();
  return std::max(va, vb) > 4.0 * std::min(va, vb);
}

void mergeNearOnes(Object& object, double threshold) {
  auto& hs = object.hypotheses.write();
  for (std::size_t i = 0; i < hs.size(); ++i) {
    for (std::size_t j = hs.size() - 1; j > i; --j) {
      if (hs[i].class_name != hs[j].class_name || hs[i].moving != hs[j].moving) continue;
      if (wider(hs[i], hs[j])) continue;
      if (distance2(hs[i], hs[j]) > threshold) continue;
      mergeInto(hs[i], hs[j]);
      hs.erase(hs.begin() + static_cast<std::ptrdiff_t>(j));
    }
  }
}

/// Without parallax nobody can tell a toy from a car: until the distance is known, "other" stays.
bool scaleIsOpen(const Object& object, const TendParameters& tend) {
  const double distance = (object.best().x.head<3>() - object.hit_view.T_WC.p).norm();
  const double variance = object.best().P.topLeftCorner<3, 3>().trace();
  return std::sqrt(variance) > tend.scale_resolved * distance;
}

/// A car half as high as cars are is none: what has drifted there has lost its way. Whatever is
/// left of the object is as likely as it was.
void pruneMisshapen(Object& object, const ClassPriors& priors, double size_gate) {
  double lost = 0.0;
  std::erase_if(object.hypotheses.write(), [&](const Hypothesis& h) {
    if (!misshapen(h, priors.of(h.class_name), size_gate)) return false;
    lost += h.weight;
    return true;
  });
  if (lost <= 0.0 || object.hypotheses.empty()) return;
  object.existence.become(object.existence * (1.0 - std::min(lost, 1.0)),
                          ExistenceEvidence::kMisshapen, object.as_of);
}

void pruneLightOnes(Object& object, const TendParameters& tend) {
  const std::string best_class = object.best().class_name;
  const bool dominant =
      object.hits >= 3 && classProbability(object, best_class) > tend.class_dominates;
  const bool open = scaleIsOpen(object, tend);
  std::erase_if(object.hypotheses.write(), [&](const Hypothesis& h) {
    if (open && h.class_name == kOtherClass && !h.moving) return h.weight < 1e-9;
    return h.weight < tend.hypothesis_floor || (dominant && h.class_name != best_class);
  });
}

void addMovingTwin(Object& object, const ClassPriors& priors, const MotionParameters& motion) {
  if (object.running_nis < motion.start_nis || hasMoving(object)) return;
  const ClassPrior& prior = priors.of(object.best().class_name);
  if (prior.moving <= 0.0 || object.hits < 3) return;
  Hypothesis twin = drivingOff(object.best());
  twin.weight *= motion.start_probability;
  twin.P.topLeftCorner<2, 2>().diagonal().array() += 0.25;
  // Or it stands where we are wrong about it: the same thing along the ray, near and far.
  Hypothesis wide = object.best();
  wide.footing = {};
  wide.weight *= motion.start_probability * motion.misplaced_odds;
  const Eigen::Vector3d ray = wide.x.head<3>() - object.hit_view.T_WC.p;
  const double relative = motion.misplaced_sigma;
  Eigen::Matrix<double, kStateDim, 1> g = Eigen::Matrix<double, kStateDim, 1>::Zero();
  g.head<3>() = ray;
  g.segment<3>(kSize).setOnes();
  wide.P += relative * relative * g * g.transpose();
  object.hypotheses.push_back(wide);
  object.hypotheses.push_back(twin);
  object.running_nis = 1.0;
}

/// Detected a few times and then no more, where nothing can be asked of it: what nobody was told
/// of, and what is mostly not there, is not kept for it to come back.
bool forgettable(const Object& o, const TendParameters& parameters) {
  if (o.once_confirmed || o.hits > static_cast<std::uint32_t>(parameters.confirm_hits))
    return false;
  const TimePoint last = std::max(o.hidden.last, o.away.last);
  const bool unasked = o.hidden.count + o.away.count > 0;
  return unasked && toSeconds(last - o.last_seen) > parameters.tentative_s;
}

/// Of the pose's covariance; nothing where that is not positive definite.
std::optional<Matrix6d> factorOf(const Matrix6d& P_pose) {
  std::optional<Matrix6d> L = P_pose;
  if (!choleskyInPlace(*L)) L.reset();
  return L;
}

double sigmaGivenPose(const Hypothesis& h, const std::optional<Matrix6d>& L_pose) {
  Eigen::Matrix<double, 3, 6> shared = Eigen::Matrix<double, 3, 6>::Zero();
  if (L_pose) {
    shared = h.C.topRows<3>();
    whitenRows(*L_pose, shared);
  }
  return std::sqrt(std::max(h.P.topLeftCorner<3, 3>().trace() - shared.squaredNorm(), 0.0));
}

}  // namespace

bool misshapen(const Hypothesis& h, const ClassPrior& prior, double size_gate) {
  const Eigen::Vector3d d = h.x.segment<3>(kSize) - prior.log_size;
  return !(deviation2<3>(d, prior.log_size_covariance) < size_gate * size_gate);
}

double distance2(const Hypothesis& a, const Hypothesis& b) {
  const Matrix7d P = a.P.topLeftCorner<kGeometry, kGeometry>();
  double result = deviation2<kGeometry>(geometryDifference(a, b), P);
  if (a.moving) {
    const Eigen::Matrix3d P_v = a.P.bottomRightCorner<3, 3>();
    result += deviation2<3>((a.x - b.x).tail<3>(), P_v);
  }
  return result;
}

Hypothesis drivingOff(Hypothesis at_rest) {
  at_rest.footing = {};
  at_rest.moving = true;
  at_rest.P.bottomRightCorner<3, 3>().diagonal() << 9.0, 9.0, 0.04;  // (3 m/s)²
  return at_rest;
}

void tendHypotheses(Object& object, const ClassPriors& priors, const Parameters& parameters) {
  weighPace(object, priors, parameters.motion);
  settleSlowOnes(object, parameters.motion.min_speed);
  mergeNearOnes(object, parameters.tend.hypothesis_merge);
  normalise(object, ClassEvidence::kMotion);
  pruneMisshapen(object, priors, parameters.tend.size_gate);
  if (object.hypotheses.empty()) return;
  normalise(object, ClassEvidence::kGeometry);
  pruneLightOnes(object, parameters.tend);
  book(object, ClassEvidence::kPruning);
  addMovingTwin(object, priors, parameters.motion);
  normalise(object, ClassEvidence::kMotion);
}

double certainty(const Object& object, const TendParameters& parameters) {
  return object.found_again ? parameters.certain_again : parameters.certain;
}

double placeSigma(const Hypothesis& h, const Matrix6d& P_pose) {
  return sigmaGivenPose(h, factorOf(P_pose));
}

double placeSigma(const Object& object, const Matrix6d& P_pose) {
  const auto L_pose = factorOf(P_pose);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& h : object.hypotheses) mean += h.weight * h.x.head<3>();
  double variance = 0.0;
  for (const auto& h : object.hypotheses) {
    const double own = sigmaGivenPose(h, L_pose);
    variance += h.weight * (own * own + (h.x.head<3>() - mean).squaredNorm());
  }
  return std::sqrt(variance);
}

bool established(const Object& object, const FrameContext& frame) {
  const TendParameters& tend = frame.parameters->tend;
  return object.existence >= tend.confirm && object.hits >= tend.confirm_hits &&
         placeSigma(object.best(), frame.pose_error.covariance) < tend.confirm_sigma_m;
}

std::vector<Object> confirmAndBury(std::vector<Object>& objects, const FrameContext& frame) {
  const TendParameters& parameters = frame.parameters->tend;
  for (auto& o : objects) {
    if (o.visible_fraction <= 0.0) continue;
    const double sigma = placeSigma(o, frame.pose_error.covariance);
    if (o.existence < 0.5 || sigma > 2.0 * parameters.confirm_sigma_m) {
      o.confirmed = false;
      continue;
    }
    if (established(o, frame) && sigma < parameters.confirm_sigma_m) {
      o.confirmed = o.once_confirmed = true;
    }
  }
  std::vector<Object> buried;
  std::erase_if(objects, [&](Object& o) {
    if (forgettable(o, parameters)) return true;
    if (o.existence >= (o.hits > 1 ? parameters.gone : parameters.gone_tentative)) return false;
    buried.push_back(std::move(o));
    return true;
  });
  const auto limit = static_cast<std::size_t>(parameters.max_objects);
  if (objects.size() <= limit) return buried;
  std::stable_sort(objects.begin(), objects.end(),
                   [](const auto& a, const auto& b) { return a.existence > b.existence; });
  objects.resize(limit);
  return buried;
}

}  // namespace perdure::semantic_filter

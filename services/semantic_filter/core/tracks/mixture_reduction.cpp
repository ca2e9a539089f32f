#include "services/semantic_filter/core/tracks/mixture_reduction.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

namespace {

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

}  // namespace

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

}  // namespace perdure::semantic_filter

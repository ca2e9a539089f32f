#include "services/semantic_filter/core/tracks/mixture_reduction.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

namespace {

bool hasMoving(const Track& track) {
  return std::any_of(track.hypotheses.begin(), track.hypotheses.end(),
                     [](const auto& h) { return h.moving; });
}

void settleSlowHypotheses(Track& track, double min_speed) {
  if (!hasMoving(track)) return;
  for (auto& h : track.hypotheses) {
    if (!h.moving) continue;
    const Eigen::Matrix2d P = h.P.block<2, 2>(kVelocity, kVelocity);
    const double sigma = std::sqrt(std::max(P.trace(), 0.0));
    if (h.x.segment<2>(kVelocity).norm() + sigma > min_speed) continue;
    stop(h);
  }
}

/// Lowers the weights of slow moving hypotheses, because moving objects seldom creep.
void applySpeedPrior(Track& track, const ClassPriors& priors, const MotionParameters& motion) {
  if (!hasMoving(track)) return;
  for (auto& h : track.hypotheses) {
    if (!h.moving) continue;
    const double slow = motion.slow_share * priors.of(h.class_name).speed_sigma;
    const double speed_prior_ratio =
        motion.creeping + (1.0 - motion.creeping) * fasterThan(h, slow);
    h.weight *= speed_prior_ratio / h.speed_prior_ratio;
    h.speed_prior_ratio = speed_prior_ratio;
  }
}

/// Whether the variances of two positions differ by more than a factor of 4. Such hypotheses are
/// two explanations, even at one place.
bool differInCertainty(const Hypothesis& a, const Hypothesis& b) {
  const double va = a.P.topLeftCorner<3, 3>().trace(), vb = b.P.topLeftCorner<3, 3>().trace();
  return std::max(va, vb) > 4.0 * std::min(va, vb);
}

void mergeNearHypotheses(Track& track, double threshold) {
  auto& hs = track.hypotheses.write();
  for (std::size_t i = 0; i < hs.size(); ++i) {
    for (std::size_t j = hs.size() - 1; j > i; --j) {
      if (hs[i].class_name != hs[j].class_name || hs[i].moving != hs[j].moving) continue;
      if (hs[i].upper_part != hs[j].upper_part) continue;
      if (differInCertainty(hs[i], hs[j])) continue;
      if (distance2(hs[i], hs[j]) > threshold) continue;
      mergeInto(hs[i], hs[j]);
      hs.erase(hs.begin() + static_cast<std::ptrdiff_t>(j));
    }
  }
}

/// Whether the distance is unknown. *Other* then stays, because without parallax a toy resembles a
/// car.
bool scaleIsUnknown(const Track& track, const TrackParameters& parameters) {
  const double distance = (track.best().x.head<3>() - track.views.detected_from.T_WC.p).norm();
  const double variance = track.best().P.topLeftCorner<3, 3>().trace();
  return std::sqrt(variance) > parameters.scale_resolved * distance;
}

/// Removes hypotheses of implausible size. Existence is multiplied by the share of the others.
void pruneMisshapen(Track& track, const ClassPriors& priors, double size_gate) {
  double lost = 0.0;
  std::erase_if(track.hypotheses.write(), [&](const Hypothesis& h) {
    if (!misshapen(h, priors.of(h.class_name), size_gate)) return false;
    lost += h.weight;
    return true;
  });
  if (lost <= 0.0 || track.hypotheses.empty()) return;
  track.existence.become(track.existence * (1.0 - std::min(lost, 1.0)),
                         ExistenceEvidence::kMisshapen, track.as_of);
}

void pruneLightHypotheses(Track& track, const TrackParameters& parameters) {
  const std::string best_class = track.best().class_name;
  const bool dominant =
      track.life.hits >= 3 && classProbability(track, best_class) > parameters.class_dominates;
  const bool scale_unknown = scaleIsUnknown(track, parameters);
  std::erase_if(track.hypotheses.write(), [&](const Hypothesis& h) {
    if (scale_unknown && h.class_name == kOtherClass && !h.moving) return h.weight < 1e-9;
    return h.weight < parameters.hypothesis_floor || (dominant && h.class_name != best_class);
  });
}

/// Adds a moving and a misplaced hypothesis to a static track with large innovations. Only the
/// weight of the moving one depends on the learned share of movers.
void addMovingAndMisplaced(Track& track, const FrameContext& frame) {
  const MotionParameters& motion = frame.parameters->motion;
  if (track.history.running_nis < motion.start_nis || hasMoving(track)) return;
  const ClassPrior& prior = frame.priors->of(track.best().class_name);
  if (prior.moving <= 0.0 || track.life.hits < 3) return;
  Hypothesis copy = asMoving(track.best());
  copy.weight *= motion.start_probability * frame.moverShare(prior) / prior.moving;
  copy.P.topLeftCorner<2, 2>().diagonal().array() += 0.25;
  // The alternative to motion: the object is at rest, but nearer or farther along the ray.
  Hypothesis misplaced = track.best();
  misplaced.ground_contact = {};
  misplaced.weight *= motion.start_probability * motion.misplaced_odds;
  const Eigen::Vector3d ray = misplaced.x.head<3>() - track.views.detected_from.T_WC.p;
  const double relative = motion.misplaced_sigma;
  Eigen::Matrix<double, kStateDim, 1> g = Eigen::Matrix<double, kStateDim, 1>::Zero();
  g.head<3>() = ray;
  g.segment<3>(kSize).setOnes();
  misplaced.P += relative * relative * g * g.transpose();
  track.hypotheses.push_back(misplaced);
  track.hypotheses.push_back(copy);
  track.history.running_nis = 1.0;
}

}  // namespace

void reduceMixture(Track& track, const FrameContext& frame) {
  const ClassPriors& priors = *frame.priors;
  const Parameters& parameters = *frame.parameters;
  applySpeedPrior(track, priors, parameters.motion);
  settleSlowHypotheses(track, parameters.motion.min_speed);
  mergeNearHypotheses(track, parameters.tracks.hypothesis_merge);
  normalise(track, ClassEvidence::kMotion);
  pruneMisshapen(track, priors, parameters.tracks.size_gate);
  if (track.hypotheses.empty()) return;
  normalise(track, ClassEvidence::kGeometry);
  pruneLightHypotheses(track, parameters.tracks);
  book(track, ClassEvidence::kPruning);
  addMovingAndMisplaced(track, frame);
  normalise(track, ClassEvidence::kMotion);
}

}  // namespace perdure::semantic_filter

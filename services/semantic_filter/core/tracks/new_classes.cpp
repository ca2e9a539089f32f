#include "services/semantic_filter/core/tracks/new_classes.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {
namespace {

/// Returns the box inside the gate that fits the geometry of the track best, whatever its class.
const BoxDetection* boxOf(const TrackScore& score, const std::vector<BoxDetection>& boxes) {
  const HypothesisScore& best = score.hypotheses.front();
  const BoxDetection* nearest = nullptr;
  double least = 0.0;
  for (std::size_t i = 0; i < score.boxes.size(); ++i) {
    if (best.matches[i].likelihood <= 0.0 || (nearest && best.matches[i].nis >= least)) continue;
    nearest = &boxes[score.boxes[i]];
    least = best.matches[i].nis;
  }
  return nearest;
}

std::vector<std::string> missing(const ClassNames& known, const ClassNames& considered) {
  std::vector<std::string> names;
  std::set_difference(known.begin(), known.end(), considered.begin(), considered.end(),
                      std::back_inserter(names));
  return names;
}

/// Returns those of the new classes that an initiation from this box would keep.
std::vector<ClassPrior> candidatesOf(const std::vector<std::string>& names, const BoxDetection& box,
                                     const FrameContext& frame) {
  const auto weight = [&](const std::string& name) {
    return std::log(frame.priors->of(name).frequency) + logRatio(box, *frame.model, name);
  };
  double best = -1e300;
  for (const auto& name : frame.model->classes) best = std::max(best, weight(name));
  const auto& initiation = frame.parameters->initiation;
  std::vector<std::pair<double, std::string>> kept;
  for (const auto& name : names) {
    const double w = weight(name);
    if (w >= best + std::log(initiation.class_ratio)) kept.emplace_back(-w, name);
  }
  std::sort(kept.begin(), kept.end());
  kept.resize(std::min(kept.size(), static_cast<std::size_t>(initiation.max_classes)));
  std::vector<ClassPrior> priors;
  for (const auto& [w, name] : kept) {
    priors.push_back(frame.priors->of(name));
    priors.back().name = name;
  }
  return priors;
}

double logSizeDensity(const Hypothesis& h, const ClassPrior& prior) {
  const SizePrior size = sizePriorOf(prior, h.upper_part);
  const Eigen::Matrix3d S = h.P.block<3, 3>(kSize, kSize) + size.covariance;
  const Eigen::Vector3d d = h.x.segment<3>(kSize) - size.mean;
  return -0.5 * (squaredMahalanobis(d, S) + std::log(S.determinant()));
}

/// Returns the hypothesis as one of another class: its geometry, conditioned on the size prior.
Hypothesis recast(Hypothesis h, const ClassPrior& prior) {
  h.class_name = prior.name;
  h.ground_contact = {};
  const SizePrior size = sizePriorOf(prior, h.upper_part);
  const Eigen::Matrix3d S = h.P.block<3, 3>(kSize, kSize) + size.covariance;
  const Eigen::Matrix<double, kStateDim, 3> K = regressOn(S, h.P.middleCols<3>(kSize));
  h.x += K * (size.mean - Eigen::Vector3d(h.x.segment<3>(kSize)));
  h.P = (h.P - K * S * K.transpose()).eval();
  h.C = (h.C - K * h.C.middleRows<3>(kSize)).eval();
  makeSymmetric(h.P);
  return h;
}

/// Returns the sum of the frequencies of the classes that the track has.
double frequencyOf(const Track& track, const ClassPriors& priors) {
  double sum = 0.0;
  for (const auto& c : classShares(track)) {
    if (c.name != kOtherClass) sum += priors.of(c.name).frequency;
  }
  return sum;
}

/// Returns the hypotheses of a new class, one for each mode and motion of the best class. Their
/// weights sum to 1.
std::vector<Hypothesis> recastAll(const Track& track, const ClassPrior& prior,
                                  const FrameContext& frame) {
  std::vector<Hypothesis> all;
  double weight = 0.0;
  for (const auto& h : track.hypotheses) {
    if (h.class_name != track.best().class_name || (h.moving && prior.moving <= 0.0)) continue;
    Hypothesis copy = recast(h, prior);
    if (misshapen(copy, prior, frame.parameters->tracks.size_gate) || !copy.x.allFinite()) continue;
    weight += copy.weight;
    all.push_back(copy);
  }
  for (auto& h : all) h.weight /= weight;
  return all;
}

/// Hypotheses of new classes. `fits`: for each new class, the likelihood of the size relative to
/// the best class, at most 1.
struct Entrants {
  std::vector<Hypothesis> hypotheses;
  ClassNumbers fits;
  double share = 0.0;  ///< sum of the weights
};

Entrants entrantsOf(const Track& track, const std::vector<ClassPrior>& entering,
                    const FrameContext& frame) {
  Entrants result;
  double frequency = frequencyOf(track, *frame.priors);
  for (const auto& prior : entering) frequency += prior.frequency;
  const double named = 1.0 - frame.parameters->clutter.other_prior;
  const double usual = logSizeDensity(track.best(), frame.priors->of(track.best().class_name));
  for (const auto& prior : entering) {
    auto copies = recastAll(track, prior, frame);
    if (copies.empty()) continue;
    const double share = named * prior.frequency / frequency;
    result.share += share;
    for (auto& h : copies) h.weight *= share;
    const double fit = logSizeDensity(track.best(), prior) - usual;
    result.fits.push_back({prior.name, std::exp(std::min(fit, 0.0))});
    result.hypotheses.insert(result.hypotheses.end(), copies.begin(), copies.end());
  }
  return result;
}

void enter(Track& track, const Entrants& entrants) {
  for (auto& h : track.hypotheses) h.weight *= 1.0 - entrants.share;
  auto& hs = track.hypotheses.write();
  hs.insert(hs.end(), entrants.hypotheses.begin(), entrants.hypotheses.end());
  normalise(track, ClassEvidence::kPrior);
  for (auto& h : track.hypotheses) {
    for (const auto& fit : entrants.fits) h.weight *= fit.name == h.class_name ? fit.value : 1.0;
  }
  normalise(track, ClassEvidence::kGeometry);
}

}  // namespace

bool admitNewClasses(Track& track, const TrackScore& score, const std::vector<BoxDetection>& boxes,
                     const FrameContext& frame) {
  const auto& known = frame.model->names;
  if (track.classes_considered == known) return false;
  if (!track.classes_considered ||
      *track.classes_considered == *known) {  // recalled tracks are skipped
    track.classes_considered = known;
    return false;
  }
  const auto names = missing(*known, *track.classes_considered);
  const BoxDetection* box = names.empty() ? nullptr : boxOf(score, boxes);
  if (!box) return false;
  ClassNames all = *track.classes_considered;
  all.insert(names.begin(), names.end());
  track.classes_considered = std::make_shared<const ClassNames>(std::move(all));
  const Entrants entrants = entrantsOf(track, candidatesOf(names, *box, frame), frame);
  if (entrants.hypotheses.empty()) return false;
  enter(track, entrants);
  return true;
}

}  // namespace perdure::semantic_filter

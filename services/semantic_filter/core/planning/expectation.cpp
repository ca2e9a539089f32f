#include "services/semantic_filter/core/planning/expectation.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/planning/entropy.h"
#include "services/semantic_filter/core/update/ekf.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/update/track_update.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kLeastShare = 1e-3;  // probability below which a detection is left out

struct Observation {
  const TimedView* view;
  TrackVisibility visibility;
  double detected;  ///< probability of a detection in this view and not in the views before
};

/// A candidate as the views leave it if none of them detects it.
struct Missed {
  Candidate candidate;
  double existence = 0.0;    ///< at the first view
  double probability = 1.0;  ///< that all views miss it, if it exists
  std::vector<Observation> observations = {};
};

FrameContext frameOf(const TimedView& view, const Observer& observer) {
  FrameContext frame;
  frame.view = {observer.camera, view.T_WB, Eigen::Vector3d::UnitZ()};
  frame.priors = observer.priors;
  frame.parameters = observer.parameters;
  return frame;
}

struct Visible {
  std::size_t candidate;
  TrackVisibility visibility;
};

/// Returns the candidates within the filter's reach that are visible, by the outlines of all.
std::vector<Visible> visibleFrom(const std::vector<Candidate>& candidates, const View& view,
                                 const Parameters& parameters) {
  const Projector from(view);
  std::vector<std::size_t> near;
  ScratchVector<Outline> outlines;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Track& track = candidates[k].track;
    const State& x = track.best().x;
    if ((x.head<3>() - from.T_WC.p).norm() > parameters.memory.recall_m) continue;
    near.push_back(k);
    outlines.push_back(outlineOf(track, x, from));
  }
  const auto visibilities = computeVisibility(outlines, {}, *view.camera, parameters.visibility);
  std::vector<Visible> visible;
  for (std::size_t i = 0; i < near.size(); ++i) {
    if (visibilities[i].fraction > 0.0) visible.push_back({near[i], visibilities[i]});
  }
  return visible;
}

/// Predicts a candidate for a view: survival, process noise, detectability, and arrival at a place.
void predictFor(Candidate& candidate, const TimedView& view, const FrameContext& frame) {
  Track& track = candidate.track;
  const MotionParameters& motion = frame.parameters->motion;
  const double dt = std::max(0.0, toSeconds(view.time - track.as_of));
  predict(track, view.time, frame.pose_error, motion, viewWalkOf(frame));
  const double arrived = candidate.stationary * (1.0 - std::exp(-dt / motion.survival_s));
  if (arrived > 0.0) {
    track.existence.become(track.existence + arrived, ExistenceEvidence::kTime, view.time);
  }
}

/// Applies a view without a detection. Returns the probability of that, if the object exists.
double miss(Track& track, const TrackVisibility& visibility, const FrameContext& frame) {
  const TrackScore score = scoreTrack(track, visibility, {}, frame);
  double missed = 0.0;
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    missed += track.hypotheses.read()[i].weight * score.hypotheses[i].no_box;
  }
  update(track, score, Eigen::RowVectorXd(), {}, frame);
  return missed;
}

/// The box that the network should report for the best hypothesis, as a measurement.
BoxMeasurement expectedBox(const PredictedBox& predicted, const FrameContext& frame) {
  const double width = frame.view.camera->width(), height = frame.view.camera->height();
  const Eigen::Vector4d& s = predicted.box.sides;
  const Box inside{std::clamp(s[0], 0.0, width), std::clamp(s[1], 0.0, height),
                   std::clamp(s[2], 0.0, width), std::clamp(s[3], 0.0, height)};
  return measure(inside, width, height, frame.parameters->box);
}

double positionEntropy(const Hypothesis& h) {
  return 0.5 * Cholesky(h.P.topLeftCorner<3, 3>()).logDeterminant() / M_LN2;
}

/// The information of detections in all views of an object that is detected at all.
struct Gained {
  double position_bits = 0.0;
  double hits = 0.0;  ///< expected number, without repetitions of the same errors
};

/// Applies the box of one view, which is reported with probability `share`.
void hit(Track& track, const Observation& observation, double share, const FrameContext& frame,
         Gained& gained) {
  const TrackScore score = scoreTrack(track, observation.visibility, {}, frame);
  const HypothesisScore& best = score.hypotheses.front();
  if (!best.predicted) return;
  Hypothesis& h = track.hypotheses[0];
  const BoxMeasurement z = expectedBox(*best.predicted, frame);
  const double repetition = noiseRepetition(track, frame);
  const auto updated = [&](double factor) {
    return updateWithBox(h, z, observation.visibility.hidden_sides, repetition * factor, frame,
                         &best.predicted->box);
  };
  gained.position_bits += share * (positionEntropy(h) - positionEntropy(updated(1.0)));
  h = updated(1.0 / share);
  gained.hits += share * temperingExponent(best.correlated_observations,
                                           frame.parameters->tempering.correlation);
  const Viewpoint here{frame.view.T_WC(), best.correlated_observations + share};
  track.views.detected_from = track.views.observed_from = here;
}

Gained gainOf(Candidate candidate, const Missed& missed, const Observer& observer) {
  Gained gained;
  for (const Observation& observation : missed.observations) {
    const double share = std::min(1.0, observation.detected / (1.0 - missed.probability));
    if (share < kLeastShare) continue;
    const ScratchScope scope;
    const FrameContext frame = frameOf(*observation.view, observer);
    predictFor(candidate, *observation.view, frame);
    hit(candidate.track, observation, share, frame, gained);
  }
  return gained;
}

Expectation expectationOf(std::size_t index, const Candidate& candidate, const Missed& missed,
                          const Observer& observer) {
  Expectation result{index, missed.existence, 1.0 - missed.probability, {}};
  const double existence = existenceFall(missed.existence, missed.probability);
  if (candidate.stationary > 0.0) {
    result.fall.unseen = existence;
    return result;
  }
  result.fall.existence = existence;
  if (!(result.detected > 0.0)) return result;
  const Gained gained = gainOf(candidate, missed, observer);
  std::vector<double> pmf;
  const ScratchScope scope;
  for (const ClassNumber& share : classShares(candidate.track)) pmf.push_back(share.value);
  const double found = result.existence * result.detected;
  result.fall.position = found * gained.position_bits;
  result.fall.classes = found * classFall(pmf, observer.nats_per_hit * gained.hits);
  return result;
}

/// Returns the activation nats of the best class against its closest rival; nothing without one.
std::optional<double> activationAgainstRival(const ObjectBelief& belief) {
  constexpr auto kActivation = static_cast<std::size_t>(ClassEvidence::kActivation);
  const auto of = [&](const std::vector<double>& nats) {
    return kActivation < nats.size() ? nats[kActivation] : 0.0;
  };
  const std::string& best = belief.best().name;
  if (belief.classes.size() > 1) {
    const auto ledgerOf = [&](const std::string& name) {
      const auto at = std::find_if(belief.why.classes.begin(), belief.why.classes.end(),
                                   [&](const ClassLedger& c) { return c.name == name; });
      return at == belief.why.classes.end() ? nullptr : &at->log_odds;
    };
    const auto *own = ledgerOf(best), *rival = ledgerOf(belief.classes[1].name);
    if (own != nullptr && rival != nullptr) return of(*own) - of(*rival);
  }
  if (belief.why.ousted.empty() || belief.why.ousted.front().by != best) return std::nullopt;
  return of(belief.why.ousted.front().log_odds);
}

}  // namespace

Fall& Fall::operator+=(const Fall& more) {
  existence += more.existence, classes += more.classes;
  position += more.position, unseen += more.unseen;
  return *this;
}

std::vector<Expectation> expect(const std::vector<Candidate>& candidates,
                                const std::vector<TimedView>& views, const Observer& observer) {
  std::map<std::size_t, Missed> all;
  for (const TimedView& view : views) {
    const ScratchScope scope;
    const FrameContext frame = frameOf(view, observer);
    for (const auto& [k, visibility] : visibleFrom(candidates, frame.view, *observer.parameters)) {
      const auto [at, first] = all.try_emplace(k, Missed{candidates[k]});
      Missed& so_far = at->second;
      predictFor(so_far.candidate, view, frame);
      if (so_far.candidate.track.hypotheses.empty()) continue;
      if (first) so_far.existence = so_far.candidate.track.existence;
      const double missed = miss(so_far.candidate.track, visibility, frame);
      so_far.observations.push_back({&view, visibility, 1.0 - missed});
      so_far.probability *= missed;
    }
  }
  std::vector<Expectation> result;
  for (const auto& [k, missed] : all) {
    result.push_back(expectationOf(k, candidates[k], missed, observer));
  }
  return result;
}

void observeNothing(std::vector<Candidate>& candidates, const TimedView& view,
                    const Observer& observer) {
  const ScratchScope scope;
  const FrameContext frame = frameOf(view, observer);
  for (const auto& [k, visibility] : visibleFrom(candidates, frame.view, *observer.parameters)) {
    Candidate& candidate = candidates[k];
    if (candidate.stationary <= 0.0) continue;
    predictFor(candidate, view, frame);
    miss(candidate.track, visibility, frame);
  }
}

double natsPerHit(const std::vector<ObjectBelief>& beliefs) {
  constexpr auto kHit = static_cast<std::size_t>(ExistenceEvidence::kHit);
  double nats = 0.0, hits = 0.0;
  for (const ObjectBelief& belief : beliefs) {
    const auto against = activationAgainstRival(belief);
    if (!against || belief.why.existence.size() <= kHit) continue;
    nats += *against;
    hits += belief.why.existence[kHit].count;
  }
  return hits > 0.0 ? std::max(0.0, nats / hits) : 0.0;
}

}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/smoothing/mode_search.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/classes/upper_part.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/parameters.h"
#include "services/semantic_filter/core/update/ground_contact.h"

namespace perdure::semantic_filter {

namespace {

bool sameMode(const Hypothesis& a, const Hypothesis& b) {
  return a.upper_part == b.upper_part &&
         std::min(distance2(a, b), distance2(b, a)) < gates::kSameMode;
}

/// Returns starts with other yaws, turned by 45°, 90° and 135°, and of usual size. An upper part
/// keeps the observed size.
ScratchVector<Hypothesis> otherStarts(const Hypothesis& best, const ClassPrior& prior) {
  ScratchVector<Hypothesis> starts;
  if (!prior.has_yaw && best.class_name != kOtherClass) return starts;
  for (int k = 1; k < 4; ++k) {
    starts.push_back(best);
    Hypothesis& h = starts.back();
    h.x[kYaw] = wrapAngle(h.x[kYaw] + k * M_PI / 4);
    if (!h.upper_part) h.x.segment<3>(kSize) = prior.log_size;
    h.weight = 0.0;
  }
  return starts;
}

/// Returns fits of an *other* track as an object of a class, from four yaws. `upper_part`: fits the
/// upper part of such an object. `as_other`: the fit of the same batch as *other*.
ScratchVector<MapFit> fitsAs(const Hypothesis& other, const ClassPrior& prior, bool upper_part,
                             const KeyframeBatch& batch, const FrameContext& frame,
                             const MapFit& as_other) {
  Hypothesis start = other;
  start.class_name = prior.name;
  start.upper_part = upper_part;
  if (!upper_part) start.x.segment<3>(kSize) = prior.log_size;
  ScratchVector<Hypothesis> starts = otherStarts(start, prior);
  starts.push_back(start);
  ScratchVector<MapFit> fits;
  for (const Hypothesis& one : starts) {
    ScratchVector<const Hypothesis*> found;
    for (const MapFit& f : fits) found.push_back(&f.hypothesis());
    auto map_fit = fit(one, batch, frame, fits.empty() ? nullptr : &fits.front(), found);
    // A fit with fewer compared sides is refused: one whose sides are all cut fits any box.
    if (!map_fit || map_fit->sides() < as_other.sides()) continue;
    const Hypothesis& h = map_fit->hypothesis();
    if (misshapen(h, prior, frame.parameters->tracks.size_gate)) continue;
    if (!upper_part || lessThanHalf(h, prior)) fits.push_back(std::move(*map_fit));
  }
  return fits;
}

}  // namespace

std::optional<MapFit> fit(const Hypothesis& start, const KeyframeBatch& batch,
                          const FrameContext& frame, const MapFit* like,
                          const ScratchVector<const Hypothesis*>& found) {
  auto map_fit = MapFit::make(start, batch, frame, like, found);
  const bool taken = map_fit && map_fit->contradicted() <= frame.parameters->smoothing.contradicted;
  return taken ? std::move(map_fit) : std::nullopt;
}

double besideKeyframes(Hypothesis& h, ObjectId id, const FrameContext& frame) {
  // An unmapped object hides each of the four sides with the same probability.
  const double share = h.upper_part ? 0.25 * frame.parameters->box.partial_view : 1.0;
  return updateWithGround(h, id, frame) + std::log(share);
}

Fitted adopt(Track& track, Hypothesis h, MapFit&& map_fit, const FrameContext& frame) {
  const double beside = besideKeyframes(h, track.id, frame);
  track.hypotheses.push_back(h);
  return {track.hypotheses.size() - 1, std::move(map_fit), beside};
}

Hypothesis atRest(const Hypothesis& moving, const Keyframes& keyframes) {
  Hypothesis h = moving;
  const double age =
      toSeconds(keyframes.back()->from->time - keyframes[keyframes.size() / 2]->from->time);
  h.x.head<3>() -= age * h.x.tail<3>();
  h.x.tail<3>().setZero();
  h.moving = false;
  h.heading_log_odds = moving.heading_log_odds;
  h.weight = 0.0;
  return h;
}

void weighMotion(std::vector<Hypothesis>& hs, const std::string& name, const Fitted& at_rest,
                 const Fitted& in_motion, const FrameContext& frame) {
  const MapFit &static_fit = at_rest.map_fit, &moving_fit = in_motion.map_fit;
  constexpr double kMaxLogOdds = 15.0;  // nats
  const ClassPrior& prior = frame.priors->of(name);
  const double share = frame.moverShare(prior);
  const auto& motion = frame.parameters->motion;
  const double speed_prior_ratio =
      motion.creeping + (1.0 - motion.creeping) * fasterThan(moving_fit.hypothesis(),
                                                             motion.slow_share * prior.speed_sigma);
  const double log_odds =
      std::clamp(static_fit.logEvidence() - moving_fit.logEvidence() + at_rest.beside -
                     in_motion.beside + std::log((1.0 - share) / share / speed_prior_ratio),
                 -kMaxLogOdds, kMaxLogOdds);
  const double p_rest = 1.0 / (1.0 + std::exp(-log_odds));
  double weight[2] = {0.0, 0.0};
  for (const auto& h : hs) {
    if (h.class_name == name) weight[h.moving] += h.weight;
  }
  const double all = weight[0] + weight[1];
  for (auto& h : hs) {
    if (h.class_name != name || weight[h.moving] <= 0.0) continue;
    h.weight *= all * (h.moving ? 1.0 - p_rest : p_rest) / weight[h.moving];
    if (h.moving) h.speed_prior_ratio = speed_prior_ratio;
  }
}

void weighModes(std::vector<Hypothesis>& hs, const Fits& fits, double least) {
  if (fits.size() < 2) return;
  constexpr double kNone = -1e9;
  ScratchVector<double> log_evidence;
  double largest = kNone, all = 0.0, sum = 0.0;
  for (auto f = fits.begin(); f != fits.end(); ++f) {
    all += hs[f->index].weight;
    const bool duplicate = std::any_of(
        fits.begin(), f, [&](const Fitted& g) { return sameMode(hs[g.index], hs[f->index]); });
    log_evidence.push_back(duplicate ? kNone : f->map_fit.logEvidence(true) + f->beside);
    largest = std::max(largest, log_evidence.back());
  }
  for (auto& e : log_evidence) {
    e = std::exp(e - largest);
    if (e < least) e = 0.0;
    sum += e;
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    hs[fits[i].index].weight = all * log_evidence[i] / sum;
  }
}

std::optional<Fitted> heaviest(const std::vector<Hypothesis>& hs, Fits&& fits) {
  const auto best = std::max_element(fits.begin(), fits.end(), [&](const auto& a, const auto& b) {
    return hs[a.index].weight < hs[b.index].weight;
  });
  return best == fits.end() ? std::nullopt : std::optional(std::move(*best));
}

void searchModes(Track& track, const KeyframeBatch& batch, const FrameContext& frame, Fits& fits) {
  const Hypothesis best = track.hypotheses[fits.front().index];
  const ClassPrior& prior = frame.priors->of(best.class_name);
  ScratchVector<Hypothesis> starts = otherStarts(best, prior);
  if (best.upper_part) {  // the whole object may be visible by now
    starts.push_back(wholeOf(best, prior));
    starts.back().weight = 0.0;
  }
  for (const auto& start : starts) {
    ScratchVector<const Hypothesis*> found;
    for (const Fitted& f : fits) {
      if (f.map_fit.hypothesis().upper_part == start.upper_part)
        found.push_back(&f.map_fit.hypothesis());
    }
    auto map_fit = fit(start, batch, frame, &fits.front().map_fit, found);
    if (!map_fit) continue;
    Hypothesis h = map_fit->hypothesis();
    h.heading_log_odds = map_fit->logHeading();
    if (h.heading_log_odds < 0.0)
      h.heading_log_odds = -h.heading_log_odds, h.x[kYaw] = wrapAngle(h.x[kYaw] + M_PI);
    fits.push_back(adopt(track, std::move(h), std::move(*map_fit), frame));
  }
}

std::optional<Fitted> tryMoving(Track& track, const Fitted& at_rest, const KeyframeBatch& batch,
                                const FrameContext& frame) {
  constexpr double kContradicted = -1.0;  // nats
  if (at_rest.beside > kContradicted || at_rest.map_fit.hypothesis().upper_part)
    return std::nullopt;
  const Hypothesis start = asMoving(track.hypotheses[at_rest.index]);
  if (frame.priors->of(start.class_name).moving <= 0.0) return std::nullopt;
  auto map_fit = fit(start, batch, frame, &at_rest.map_fit);
  if (!map_fit) return std::nullopt;
  Hypothesis h = map_fit->hypothesis();
  h.weight = 1e-3 * start.weight;
  return adopt(track, std::move(h), std::move(*map_fit), frame);
}

void tryLookalikeClass(Track& track, const KeyframeBatch& batch, const FrameContext& frame) {
  constexpr double kLeastOdds = -6.0, kMaxLogOdds = 15.0;  // nats
  const Hypothesis other = track.best();
  if (other.class_name != kOtherClass || other.moving || track.lookalike.class_name.empty()) return;
  if (classProbability(track, track.lookalike.class_name) > 0.0) return;
  const Parameters& p = *frame.parameters;
  const ClassPrior& prior = frame.priors->of(track.lookalike.class_name);
  if (prior.name != track.lookalike.class_name) return;
  const auto as_other = fit(other, batch, frame);
  if (!as_other) return;
  const Hypothesis& fitted_other = as_other->hypothesis();
  const double distance = (fitted_other.x.head<3>() - frame.view.T_WC().p).norm();
  const double place = std::sqrt(fitted_other.P.topLeftCorner<3, 3>().trace());
  if (place > p.tracks.scale_resolved * distance) return;
  ScratchVector<MapFit> fits = fitsAs(other, prior, false, batch, frame, *as_other);
  if (p.box.partial_view > 0.0) {
    for (MapFit& one : fitsAs(other, prior, true, batch, frame, *as_other))
      fits.push_back(std::move(one));
  }
  if (fits.empty()) return;
  const double other_evidence = as_other->logEvidence();
  const double initial_log_odds = std::log((1.0 - p.clutter.other_prior) / p.clutter.other_prior) -
                                  std::log(std::max(p.clutter.other_lookalike, 1e-3));
  for (const MapFit& one : fits) {
    Hypothesis h = one.hypothesis();
    const double beside = besideKeyframes(h, track.id, frame);
    const double odds = one.logEvidence() - other_evidence + initial_log_odds + beside;
    if (odds < kLeastOdds) continue;
    track.hypotheses.push_back(h);
    track.hypotheses.back().weight = other.weight * std::exp(std::min(odds, kMaxLogOdds));
  }
  normalise(track, ClassEvidence::kGeometry);
}

}  // namespace perdure::semantic_filter

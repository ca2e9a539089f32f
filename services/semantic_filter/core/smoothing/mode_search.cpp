#include "services/semantic_filter/core/smoothing/mode_search.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/update/ground_contact.h"

namespace perdure::semantic_filter {

namespace {

bool oneMode(const Hypothesis& a, const Hypothesis& b) {
  constexpr double kTwins = 1.0;  // squared deviations
  return std::min(distance2(a, b), distance2(b, a)) < kTwins;
}

/// A thing at rest as none of its hypotheses may have it: turned, and of usual size.
std::vector<Hypothesis> otherStarts(const Hypothesis& best, const ClassPrior& prior) {
  std::vector<Hypothesis> starts;
  if (!prior.has_yaw && best.class_name != kOtherClass) return starts;
  for (int k = 1; k < 4; ++k) {
    starts.push_back(best);
    Hypothesis& h = starts.back();
    h.x[kYaw] = wrapAngle(h.x[kYaw] + k * M_PI / 4);
    h.x.segment<3>(kSize) = prior.log_size;
    h.weight = 0.0;
  }
  return starts;
}

}  // namespace

std::optional<Smoothed> fit(const Hypothesis& start, const Looks& looks, const FrameContext& frame,
                            const Smoothed* like,
                            const std::vector<const Hypothesis*>& found) {
  auto smoothed = Smoothed::make(start, looks, frame, like, found);
  const bool taken = smoothed && smoothed->contradicted() <= frame.parameters->smooth.contradicted;
  return taken ? std::move(smoothed) : std::nullopt;
}

Fitted adopt(Object& object, Hypothesis h, Smoothed&& smoothed, const FrameContext& frame) {
  const double ground = standOnGround(h, object.id, frame);
  object.hypotheses.push_back(h);
  return {object.hypotheses.size() - 1, std::move(smoothed), ground};
}

Hypothesis atRest(const Hypothesis& moving, const Keyframes& keyframes) {
  Hypothesis h = moving;
  const double age =
      toSeconds(keyframes.back()->from->time - keyframes[keyframes.size() / 2]->from->time);
  h.x.head<3>() -= age * h.x.tail<3>();
  h.x.tail<3>().setZero();
  h.moving = false;
  h.head = moving.head;
  h.weight = 0.0;
  return h;
}

void weighMotion(std::vector<Hypothesis>& hs, const std::string& name, const Fitted& at_rest,
                 const Fitted& driving, const FrameContext& frame) {
  const Smoothed &still = at_rest.smoothed, &moving = driving.smoothed;
  constexpr double kSurest = 15.0;  // nats
  const ClassPrior& prior = frame.priors->of(name);
  const auto& motion = frame.parameters->motion;
  const Eigen::VectorXd doubts = still.doubts().cwiseMin(moving.doubts());
  const double pace =
      motion.creeping + (1.0 - motion.creeping) *
                            fasterThan(moving.hypothesis(), motion.slow_share * prior.speed_sigma);
  const double log_odds =
      std::clamp(still.logEvidence(doubts) - moving.logEvidence(doubts) + at_rest.ground -
                     driving.ground + std::log((1.0 - prior.moving) / prior.moving / pace),
                 -kSurest, kSurest);
  const double rests = 1.0 / (1.0 + std::exp(-log_odds));
  double weight[2] = {0.0, 0.0};
  for (const auto& h : hs) {
    if (h.class_name == name) weight[h.moving] += h.weight;
  }
  const double all = weight[0] + weight[1];
  for (auto& h : hs) {
    if (h.class_name != name || weight[h.moving] <= 0.0) continue;
    h.weight *= all * (h.moving ? 1.0 - rests : rests) / weight[h.moving];
    if (h.moving) h.pace = pace;
  }
}

void weighModes(std::vector<Hypothesis>& hs, const Fits& fits, double least) {
  if (fits.size() < 2) return;
  Eigen::VectorXd doubts = fits.front().smoothed.doubts();
  for (const auto& f : fits) doubts = doubts.cwiseMin(f.smoothed.doubts());
  constexpr double kNone = -1e9;
  std::vector<double> evidence;
  double most = kNone, all = 0.0, sum = 0.0;
  for (auto f = fits.begin(); f != fits.end(); ++f) {
    all += hs[f->index].weight;
    const bool twin = std::any_of(
        fits.begin(), f, [&](const Fitted& g) { return oneMode(hs[g.index], hs[f->index]); });
    evidence.push_back(twin ? kNone : f->smoothed.logEvidence(doubts, true) + f->ground);
    most = std::max(most, evidence.back());
  }
  for (auto& e : evidence) {
    e = std::exp(e - most);
    if (e < least) e = 0.0;
    sum += e;
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    hs[fits[i].index].weight = all * evidence[i] / sum;
  }
}

std::optional<Fitted> heaviest(const std::vector<Hypothesis>& hs, Fits&& fits) {
  const auto best = std::max_element(fits.begin(), fits.end(), [&](const auto& a, const auto& b) {
    return hs[a.index].weight < hs[b.index].weight;
  });
  return best == fits.end() ? std::nullopt : std::optional(std::move(*best));
}

void seekModes(Object& object, const Looks& looks, const FrameContext& frame, Fits& fits) {
  const Hypothesis best = object.hypotheses[fits.front().index];
  for (const auto& start : otherStarts(best, frame.priors->of(best.class_name))) {
    std::vector<const Hypothesis*> found;
    for (const Fitted& f : fits) found.push_back(&f.smoothed.hypothesis());
    auto smoothed = fit(start, looks, frame, &fits.front().smoothed, found);
    if (!smoothed) continue;
    Hypothesis h = smoothed->hypothesis();
    h.head = smoothed->logHead();
    if (h.head < 0.0) h.head = -h.head, h.x[kYaw] = wrapAngle(h.x[kYaw] + M_PI);
    fits.push_back(adopt(object, std::move(h), std::move(*smoothed), frame));
  }
}

std::optional<Fitted> driveFrom(Object& object, const Fitted& at_rest, const Looks& looks,
                                const FrameContext& frame) {
  constexpr double kContradicted = -1.0;  // nats
  if (at_rest.ground > kContradicted) return std::nullopt;
  const Hypothesis start = drivingOff(object.hypotheses[at_rest.index]);
  if (frame.priors->of(start.class_name).moving <= 0.0) return std::nullopt;
  auto smoothed = fit(start, looks, frame, &at_rest.smoothed);
  if (!smoothed) return std::nullopt;
  Hypothesis h = smoothed->hypothesis();
  h.weight = 1e-3 * start.weight;
  return adopt(object, std::move(h), std::move(*smoothed), frame);
}

void tryWhatItResembles(Object& object, const Looks& looks, const FrameContext& frame) {
  constexpr double kLeastOdds = -6.0, kSurest = 15.0;  // nats
  const Hypothesis other = object.best();
  if (other.class_name != kOtherClass || other.moving || object.resembles.empty()) return;
  if (classProbability(object, object.resembles) > 0.0) return;
  const Parameters& p = *frame.parameters;
  const ClassPrior& prior = frame.priors->of(object.resembles);
  if (prior.name != object.resembles) return;
  const auto as_other = fit(other, looks, frame);
  if (!as_other) return;
  const Hypothesis& whole = as_other->hypothesis();
  const double distance = (whole.x.head<3>() - frame.view.T_WC().p).norm();
  const double place = std::sqrt(whole.P.topLeftCorner<3, 3>().trace());
  if (place > p.tend.scale_resolved * distance) return;
  Hypothesis start = other;
  start.class_name = object.resembles;
  start.x.segment<3>(kSize) = prior.log_size;
  std::vector<Hypothesis> starts = otherStarts(start, prior);
  starts.push_back(start);
  std::vector<Smoothed> fits;
  for (const Hypothesis& one : starts) {
    std::vector<const Hypothesis*> found;
    for (const Smoothed& f : fits) found.push_back(&f.hypothesis());
    auto smoothed = fit(one, looks, frame, fits.empty() ? nullptr : &fits.front(), found);
    // What the image's border cuts on all sides fits any box.
    if (smoothed && smoothed->sides() >= as_other->sides() &&
        !misshapen(smoothed->hypothesis(), prior, p.tend.size_gate)) {
      fits.push_back(std::move(*smoothed));
    }
  }
  if (fits.empty()) return;
  Eigen::VectorXd doubts = as_other->doubts();
  for (const Smoothed& one : fits) doubts = doubts.cwiseMin(one.doubts());
  const double most = as_other->logEvidence(doubts);
  const double at_birth = std::log((1.0 - p.clutter.other_prior) / p.clutter.other_prior) -
                          std::log(std::max(p.clutter.other_lookalike, 1e-3));
  for (const Smoothed& one : fits) {
    Hypothesis h = one.hypothesis();
    const double ground = standOnGround(h, object.id, frame);
    const double odds = one.logEvidence(doubts) - most + at_birth + ground;
    if (odds < kLeastOdds) continue;
    object.hypotheses.push_back(h);
    object.hypotheses.back().weight = other.weight * std::exp(std::min(odds, kSurest));
  }
  normalise(object, ClassEvidence::kGeometry);
}

}  // namespace perdure::semantic_filter

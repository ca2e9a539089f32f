#include "services/semantic_filter/core/smoothing/refit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/smoothing/map_fit.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"

namespace perdure::semantic_filter {
namespace {

/// The thing at rest where the looks say, when the filter has come to believe that it moves.
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

/// A fit of one of an object's hypotheses, by its index.
struct Fitted {
  std::size_t index;
  Smoothed smoothed;
  double ground;  ///< nats, of standing on it
};
using Fits = std::vector<Fitted>;

/// A fit that none of the object's hypotheses had, with its own `h`.
Fitted adopt(Object& object, Hypothesis h, Smoothed&& smoothed, const FrameContext& frame) {
  const double ground = standOnGround(h, object.id, frame);
  object.hypotheses.push_back(h);
  return {object.hypotheses.size() - 1, std::move(smoothed), ground};
}

/// Of one class: whether it moves, by what all looks and the ground say.
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

bool oneMode(const Hypothesis& a, const Hypothesis& b) {
  constexpr double kTwins = 1.0;  // squared deviations
  return std::min(distance2(a, b), distance2(b, a)) < kTwins;
}

/// What all looks and the ground say of each mode. One that was reached twice counts once; those
/// that say less than `least` of the best go.
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

/// The fit whose hypothesis weighs most.
std::optional<Fitted> heaviest(const std::vector<Hypothesis>& hs, Fits&& fits) {
  const auto best = std::max_element(fits.begin(), fits.end(), [&](const auto& a, const auto& b) {
    return hs[a.index].weight < hs[b.index].weight;
  });
  return best == fits.end() ? std::nullopt : std::optional(std::move(*best));
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

/// What the fits that were taken say of each look.
struct Verdicts {
  int fits = 0;
  Eigen::ArrayXi against;
  void add(const Eigen::ArrayXi& contradictions) {
    against = fits++ == 0 ? contradictions : Eigen::ArrayXi(against + contradictions);
  }
};

/// A look that contradicts every fit showed something else.
void forgetContradicted(Object& object, const Verdicts& verdicts, std::size_t least) {
  if (verdicts.fits == 0) return;
  std::vector<std::shared_ptr<const Keyframe>> kept;
  const auto& all = object.keyframes.read();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (verdicts.against[static_cast<Eigen::Index>(i)] < verdicts.fits) kept.push_back(all[i]);
  }
  if (kept.size() >= least) object.keyframes = std::move(kept);
}

/// Nothing where too many looks contradict.
std::optional<Smoothed> fit(const Hypothesis& start, const Looks& looks, const FrameContext& frame,
                            const Smoothed* like = nullptr,
                            const std::vector<const Hypothesis*>& found = {}) {
  auto smoothed = Smoothed::make(start, looks, frame, like, found);
  const bool taken = smoothed && smoothed->contradicted() <= frame.parameters->smooth.contradicted;
  return taken ? std::move(smoothed) : std::nullopt;
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

/// What stands where the ground is not may go along it elsewhere: one that moves, which the filter
/// has given up, is tried again.
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

/// What the best fit of a thing of the class at rest leaves over.
std::optional<Leftovers> smoothClass(Object& object, const std::string& name, const Looks& looks,
                                     const FrameContext& frame, bool seek, Verdicts& verdicts) {
  const auto& p = frame.parameters->smooth;
  Fits still, moving;
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    auto& h = object.hypotheses[i];
    if (h.class_name != name || h.weight < p.least_weight) continue;
    Fits& others = h.moving ? moving : still;
    auto smoothed = fit(h, looks, frame, others.empty() ? nullptr : &others.front().smoothed);
    if (!smoothed) continue;
    h = smoothed->hypothesis();
    const double ground = standOnGround(h, object.id, frame);
    verdicts.add(smoothed->contradictions());
    others.push_back({i, std::move(*smoothed), ground});
  }
  if (seek && !still.empty() && name == object.best().class_name) {
    seekModes(object, looks, frame, still);
    for (const Fitted& f : still) object.hypotheses[f.index].modes_sought = true;
  }
  weighModes(object.hypotheses.write(), still, p.least_weight);
  weighModes(object.hypotheses.write(), moving, p.least_weight);
  auto at_rest = heaviest(object.hypotheses.read(), std::move(still));
  std::optional<Leftovers> over;
  if (at_rest) {
    over = Leftovers{at_rest->smoothed.leftover(), at_rest->smoothed.leftoverOfAzimuths()};
  }
  auto driving = heaviest(object.hypotheses.read(), std::move(moving));
  if (!driving && at_rest) driving = driveFrom(object, *at_rest, looks, frame);
  if (!driving) return over;
  if (!at_rest) {
    const Hypothesis& mover = driving->smoothed.hypothesis();
    auto smoothed = fit(atRest(mover, object.keyframes.read()), looks, frame);
    if (!smoothed) return over;
    Hypothesis h = smoothed->hypothesis();
    h.weight = 1e-3 * mover.weight;
    at_rest.emplace(adopt(object, std::move(h), std::move(*smoothed), frame));
  }
  weighMotion(object.hypotheses.write(), name, *at_rest, *driving, frame);
  return over;
}

/// A thing of no known class that the network takes for one: boxes that were of two things make the
/// shape of none, and what is of no known class takes any. Whether all looks together are of the
/// class after all. To look like one at all is paid for once, as at birth.
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

/// All of its looks are of the present network, and it is something that stands.
bool tellsOfBoxes(const Object& object, const FrameContext& frame) {
  constexpr double kSure = 0.9;
  const Hypothesis& best = object.best();
  return !best.moving && best.class_name != kOtherClass && object.existence > kSure &&
         movingProbability(object, frame.parameters->motion.min_speed) < 1.0 - kSure &&
         std::all_of(object.keyframes.begin(), object.keyframes.end(),
                     [&](const auto& k) { return k->from->errors.model == frame.errors.model; });
}

}  // namespace

bool rememberLook(Object& object, const Evidence& box, const std::array<bool, 4>& hidden,
                  const FrameContext& frame) {
  const auto& p = *frame.parameters;
  if (p.smooth.keyframes == 0 || !frame.key_view || !object.remembers_all) return false;
  const ViewScales scales{p.box.bias_angle, p.box.bias_log_distance, p.box.bias_image_angle};
  Keyframe keyframe{frame.key_view, box.z, hidden, box.azimuth, box.azimuth_sigma};
  if (!remember(object, std::move(keyframe), scales, p.smooth)) return false;
  if (object.keyframes.size() < static_cast<std::size_t>(p.smooth.least)) return false;
  ++object.fresh_keyframes;
  ++object.remembered;
  return smoothingNeed(object, p.smooth.fresh) >= 1.0;
}

double smoothingNeed(const Object& object, double fresh) {
  return object.fresh_keyframes /
         (fresh * static_cast<double>(object.keyframes.size()) * object.smoothing_patience);
}

std::optional<Leftovers> smooth(Object& object, const FrameContext& frame) {
  const auto most_patience = static_cast<std::uint32_t>(frame.parameters->smooth.patience);
  constexpr double kLittle = 1.0;  // squared deviations, of seven dimensions
  const auto& p = *frame.parameters;
  const double fresh = object.fresh_keyframes / static_cast<double>(object.keyframes.size());
  object.fresh_keyframes = 0;
  const Hypothesis before = object.best();
  const Looks looks(object.keyframes.read(), frame.pose_error);
  std::set<std::string> names;
  for (const auto& h : object.hypotheses.read()) names.insert(h.class_name);
  const bool seek = object.remembered >= object.seek_modes_at;
  if (seek) object.seek_modes_at = 2 * object.remembered;
  Verdicts verdicts;
  std::map<std::string, Leftovers> over;
  for (const auto& name : names) {
    const auto left = smoothClass(object, name, looks, frame, seek, verdicts);
    if (left) over[name] = *left;
  }
  std::erase_if(object.hypotheses.write(), [](const Hypothesis& h) { return h.weight <= 0.0; });
  normalise(object, ClassEvidence::kMotion);
  tryWhatItResembles(object, looks, frame);
  forgetContradicted(object, verdicts, static_cast<std::size_t>(p.smooth.least));
  const bool same =
      before.class_name == object.best().class_name && before.moving == object.best().moving;
  const bool settled = same && distance2(before, object.best()) < kLittle;
  object.smoothing_patience = settled ? std::min(2 * object.smoothing_patience, most_patience) : 1;
  const auto told = over.find(object.best().class_name);
  if (told == over.end() || !tellsOfBoxes(object, frame)) return std::nullopt;
  Leftovers result = told->second;
  for (Leftover* one : {&result.sides, &result.azimuths}) one->count *= std::min(fresh, 1.0);
  return result;
}

}  // namespace perdure::semantic_filter

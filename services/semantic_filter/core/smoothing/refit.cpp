#include "services/semantic_filter/core/smoothing/refit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/smoothing/mode_search.h"
#include "services/semantic_filter/core/update/ground_contact.h"

namespace perdure::semantic_filter {

namespace {

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

void smoothNeediest(std::vector<Object*>& objects, Belief& belief,
                                    const FrameContext& frame) {
  const double fresh = frame.parameters->smooth.fresh;
  std::stable_sort(objects.begin(), objects.end(), [fresh](const Object* a, const Object* b) {
    return smoothingNeed(*a, fresh) > smoothingNeed(*b, fresh);
  });
  const auto most = static_cast<std::size_t>(frame.parameters->smooth.per_frame);
  if (objects.size() > most) objects.resize(most);
  for (Object* object : objects) {
    const double share = object->fresh_keyframes / static_cast<double>(object->keyframes.size());
    if (const auto over = smooth(*object, frame)) {
      belief.learned.sides.hear(frame.errors.model, over->sides);
      belief.learned.azimuths.hear(frame.errors.model, over->azimuths);
    }
    frame.ground->tell(belief.learned.evenness, *object, share);
  }
}

}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/smoothing/refit.h"

#include <algorithm>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/parameters.h"
#include "services/semantic_filter/core/smoothing/mode_search.h"

namespace perdure::semantic_filter {

namespace {

struct ContradictionCounts {
  int fits = 0;
  KeyframeCounts counts;
  void add(const KeyframeCounts& contradictions) {
    counts = fits++ == 0 ? contradictions : KeyframeCounts(counts + contradictions);
  }
};

/// Removes the keyframes that contradict every fit, because they show another object.
void dropContradicted(Track& track, const ContradictionCounts& contradictions, std::size_t least) {
  if (contradictions.fits == 0) return;
  std::vector<std::shared_ptr<const Keyframe>> kept;
  const auto& all = track.batch.keyframes.read();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (contradictions.counts[static_cast<Eigen::Index>(i)] < contradictions.fits)
      kept.push_back(all[i]);
  }
  if (kept.size() >= least) track.batch.keyframes = std::move(kept);
}

/// Returns the evidence, in nats, that the boxes of an object at rest enclose its outline, not its
/// cuboid; nothing if the fit with the other extent fails.
std::optional<double> outlineNats(const MapFit& at_rest, const KeyframeBatch& batch,
                                  const FrameContext& frame) {
  constexpr double kMost = 3.0;  // nats; an object of an unusual shape must not decide alone
  const BoxStyles* outlines = frame.model->outline_styles.get();
  const bool as_outlines = frame.styles == outlines;
  FrameContext other = frame;
  other.styles = as_outlines ? frame.model->styles.get() : outlines;
  const auto as_other = MapFit::make(at_rest.hypothesis(), batch, other);
  if (!as_other) return std::nullopt;
  const double nats = as_other->logEvidence() - at_rest.logEvidence();
  return std::clamp(as_outlines ? -nats : nats, -kMost, kMost);
}

/// Fits the hypotheses of one class. Returns the evidence of its best fit at rest.
std::optional<NetworkEvidence> refitClass(Track& track, const std::string& name,
                                          const KeyframeBatch& batch, const FrameContext& frame,
                                          bool search, ContradictionCounts& contradictions) {
  const auto& p = frame.parameters->smoothing;
  Fits static_fits, moving_fits;
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    auto& h = track.hypotheses[i];
    if (h.class_name != name || h.weight < p.least_weight) continue;
    Fits& fits = h.moving ? moving_fits : static_fits;
    auto map_fit = fit(h, batch, frame, fits.empty() ? nullptr : &fits.front().map_fit);
    if (!map_fit) continue;
    h = map_fit->hypothesis();
    const double beside = besideKeyframes(h, track.id, frame);
    contradictions.add(map_fit->contradictions());
    fits.push_back({i, std::move(*map_fit), beside});
  }
  if (search && !static_fits.empty() && name == track.best().class_name) {
    searchModes(track, batch, frame, static_fits);
    for (const Fitted& f : static_fits) track.hypotheses[f.index].modes_searched = true;
  }
  weighModes(track.hypotheses.write(), static_fits, p.least_weight);
  weighModes(track.hypotheses.write(), moving_fits, p.least_weight);
  auto at_rest = heaviest(track.hypotheses.read(), std::move(static_fits));
  std::optional<NetworkEvidence> evidence;
  if (at_rest) {
    evidence = {search ? at_rest->map_fit.sideEvidence() : SideEvidence(),
                at_rest->map_fit.azimuthResidualRatio()};
    if (frame.estimates_extent && name == track.best().class_name)
      evidence->outline_nats = outlineNats(at_rest->map_fit, batch, frame);
  }
  auto in_motion = heaviest(track.hypotheses.read(), std::move(moving_fits));
  if (!in_motion && at_rest) in_motion = tryMoving(track, *at_rest, batch, frame);
  if (!in_motion) return evidence;
  if (!at_rest) {
    const Hypothesis& mover = in_motion->map_fit.hypothesis();
    auto map_fit = fit(atRest(mover, track.batch.keyframes.read()), batch, frame);
    if (!map_fit) return evidence;
    Hypothesis h = map_fit->hypothesis();
    h.weight = 1e-3 * mover.weight;
    at_rest.emplace(adopt(track, std::move(h), std::move(*map_fit), frame));
  }
  weighMotion(track.hypotheses.write(), name, *at_rest, *in_motion, frame);
  return evidence;
}

/// Whether the track surely exists, is at rest, has a known class, and all its keyframes are of the
/// present network.
bool informsAboutNetwork(const Track& track, const FrameContext& frame) {
  constexpr double kSure = 0.9;
  const Hypothesis& best = track.best();
  return !best.moving && best.class_name != kOtherClass && track.existence > kSure &&
         movingProbability(track, frame.parameters->motion.min_speed) < 1.0 - kSure &&
         std::all_of(
             track.batch.keyframes.begin(), track.batch.keyframes.end(),
             [&](const auto& k) { return k->from->noise_scale.model == frame.noise_scale.model; });
}

}  // namespace

bool considerKeyframe(Track& track, const BoxDetection& box, const std::array<bool, 4>& hidden,
                      const FrameContext& frame) {
  const auto& p = *frame.parameters;
  if (p.smoothing.keyframes == 0 || !frame.frame_view || !track.batch.complete) return false;
  Keyframe keyframe{frame.frame_view, box.z, hidden, box.azimuth, box.azimuth_sigma};
  if (!addKeyframe(track, std::move(keyframe), biasScales(p.box), p.smoothing)) return false;
  if (track.batch.keyframes.size() < static_cast<std::size_t>(p.smoothing.least)) return false;
  ++track.batch.fresh;
  ++track.batch.seen;
  return refitNeed(track, p.smoothing.fresh) >= 1.0;
}

double refitNeed(const Track& track, double fresh) {
  return track.batch.fresh /
         (fresh * static_cast<double>(track.batch.keyframes.size()) * track.batch.patience);
}

std::optional<NetworkEvidence> refit(Track& track, const FrameContext& frame) {
  const ScratchScope scope;
  const auto most_patience = static_cast<std::uint32_t>(frame.parameters->smoothing.patience);
  const auto& p = *frame.parameters;
  const double fresh = track.batch.fresh / static_cast<double>(track.batch.keyframes.size());
  track.batch.fresh = 0;
  const Hypothesis before = track.best();
  const KeyframeBatch batch(track.batch.keyframes.read(), frame.pose_error);
  ScratchVector<std::string> names;  // a fit may add hypotheses
  for (const auto& h : track.hypotheses.read()) {
    const auto at = std::lower_bound(names.begin(), names.end(), h.class_name);
    if (at == names.end() || *at != h.class_name) names.insert(at, h.class_name);
  }
  const bool search = track.batch.seen >= track.batch.mode_search_due;
  // The evidence about sides is computed at a mode search only, because it costs as much as a fit.
  const double since_search =
      (track.batch.seen - 0.5 * track.batch.mode_search_due) / static_cast<double>(batch.size());
  const double unsearched =
      track.batch.mode_search_due == 0 ? 1.0 : std::clamp(since_search, 0.0, 1.0);
  if (search) track.batch.mode_search_due = 2 * track.batch.seen;
  ContradictionCounts contradictions;
  ScratchMap<std::string, NetworkEvidence> evidence;
  for (const auto& name : names) {
    const auto of_class = refitClass(track, name, batch, frame, search, contradictions);
    if (of_class) evidence[name] = *of_class;
  }
  std::erase_if(track.hypotheses.write(), [](const Hypothesis& h) { return h.weight <= 0.0; });
  normalise(track, ClassEvidence::kMotion);
  tryLookalikeClass(track, batch, frame);
  dropContradicted(track, contradictions, static_cast<std::size_t>(p.smoothing.least));
  const bool same =
      before.class_name == track.best().class_name && before.moving == track.best().moving;
  const bool settled = same && distance2(before, track.best()) < gates::kUnchanged;
  track.batch.patience = settled ? std::min(2 * track.batch.patience, most_patience) : 1;
  const auto of_best = evidence.find(track.best().class_name);
  if (of_best == evidence.end() || !informsAboutNetwork(track, frame)) return std::nullopt;
  NetworkEvidence result = of_best->second;
  result.azimuths.count *= std::min(fresh, 1.0);
  result.sides.information *= unsearched;
  result.sides.gradient *= unsearched;
  return result;
}

void refitNeediest(ScratchVector<Track*>& tracks, Belief& belief, const FrameContext& frame) {
  const double fresh = frame.parameters->smoothing.fresh;
  std::stable_sort(tracks.begin(), tracks.end(), [fresh](const Track* a, const Track* b) {
    return refitNeed(*a, fresh) > refitNeed(*b, fresh);
  });
  const auto most = static_cast<std::size_t>(frame.parameters->smoothing.per_frame);
  if (tracks.size() > most) tracks.resize(most);
  for (Track* track : tracks) {
    const double share = track->batch.fresh / static_cast<double>(track->batch.keyframes.size());
    if (const auto evidence = refit(*track, frame)) {
      const std::uint64_t model = frame.noise_scale.model;
      belief.learned.sides.learn(model, evidence->sides, frame.parameters->box.prior_sides);
      belief.learned.azimuths.learn(model, evidence->azimuths);
      if (evidence->outline_nats) {
        CountedExtent& counted = track->batch.extent;
        if (counted.model != model) counted = {model, 0.0};
        belief.learned.extents.learn(model, *evidence->outline_nats - counted.nats);
        counted.nats = *evidence->outline_nats;
      }
    }
    frame.ground->updateRoughness(belief.learned.roughness_scale, *track, share);
  }
}

}  // namespace perdure::semantic_filter

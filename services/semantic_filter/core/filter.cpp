#include "services/semantic_filter/core/filter.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "services/semantic_filter/core/association/box_explanation.h"
#include "services/semantic_filter/core/association/joint_association.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/smoothing/refit.h"
#include "services/semantic_filter/core/tracks/initiation.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "services/semantic_filter/core/tracks/new_classes.h"
#include "services/semantic_filter/core/tracks/reidentify.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/update/track_update.h"

namespace perdure::semantic_filter {

namespace {

NoiseScale noiseScaleOf(const Belief& belief, const FrameInput& input, const BoxParameters& box) {
  const std::uint64_t model = input.model->network;
  return {model, belief.learned.sides.scales(model),
          belief.learned.azimuths.ratio(model, box.prior_azimuths)};
}

/// Returns the input with the learned noise of the network in its boxes.
FrameInput withLearnedNoise(const Belief& belief, FrameInput input, const BoxParameters& box) {
  const NoiseScale scale = noiseScaleOf(belief, input, box);
  for (BoxDetection& detection : *input.boxes) {
    detection.z.variance *= scale.sides.noise;
    detection.z.lasting *= scale.sides.lasting;
  }
  return input;
}

FrameContext contextOf(const Belief& belief, const FrameInput& input, const Parameters& parameters,
                       const ClassPriors& priors) {
  const NoiseScale noise_scale = noiseScaleOf(belief, input, parameters.box);
  return {input.view,
          input.pose_error,
          input.model.get(),
          &priors,
          &parameters,
          std::make_shared<const FrameView>(input.view, input.pose_error, input.stamp.time,
                                            input.styles(), noise_scale),
          noise_scale,
          std::make_shared<const GroundSurface>(belief.tracks, belief.path,
                                                belief.learned.roughness_scale, input.view.up_W,
                                                priors, parameters.ground),
          &belief.learned.movers,
          input.styles().get(),
          belief.learned.sizes.scale(input.model->network),
          input.model->outline_styles && !belief.learned.extents.decided(input.model->network)};
}

/// Sets the visibility of all tracks and returns it in the order of the tracks.
ScratchVector<TrackVisibility> updateVisibility(Belief& belief, const FrameInput& input,
                                                const VisibilityParameters& parameters) {
  const Projector from(input.view);
  ScratchVector<Outline> outlines;
  outlines.reserve(belief.tracks.size());
  for (const auto& o : belief.tracks) {
    outlines.push_back(
        outlineOf(o, stateAt(o.best(), toSeconds(input.stamp.time - o.as_of)), from));
  }
  const auto& camera = *input.view.camera;
  auto visibilities =
      computeVisibility(outlines, input.points, camera, parameters);
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    Track& o = belief.tracks[j];
    o.visibility.state = visibilities[j].state;
    o.visibility.fraction = visibilities[j].fraction;
    o.visibility.blocked_by = visibilities[j].blocked_by;
  }
  return visibilities;
}

void noteNotVisible(Track& track, Visibility why, TimePoint now, double min_speed) {
  if (track.unused.count() == 0) stopSlowHypotheses(track, min_speed);
  const bool away = why == Visibility::kOutOfView || why == Visibility::kBehind;
  LedgerEntry& entry = away ? track.unused.out_of_view : track.unused.occluded;
  if (entry.count++ == 0) entry.first = now;
  entry.last = now;
}

struct ScoredTrack {
  std::size_t track;  ///< index in Belief::tracks
  TrackScore score;
  std::optional<std::size_t> assigned = {};  ///< the box of the frame that is assigned to the track
  /// The track before its update, if it has been confirmed, is static, and a box is near. It
  /// replaces the track if the box deforms it.
  std::optional<Track> before = {};
  bool sound = true;  ///< whether its numbers are valid after the update
};

struct Step {
  Belief& belief;
  const FrameInput& input;
  const FrameContext& frame;
  const std::vector<BoxDetection>& boxes = *input.boxes;
  const Parameters& parameters = *frame.parameters;
  const TimePoint now = input.stamp.time;

  ScratchVector<ScoredTrack> scoreAll(const ScratchVector<TrackVisibility>& visibilities);
  Eigen::VectorXd associateAndUpdate(ScratchVector<ScoredTrack>& scored);
  void manage(Track& track, ScoredTrack& scored);
  void manageAll(ScratchVector<ScoredTrack>& scored);
  void resolveIdentities(StepReport& report);
};

ScratchVector<ScoredTrack> Step::scoreAll(const ScratchVector<TrackVisibility>& visibilities) {
  ScratchVector<ScoredTrack> scored;
  scored.reserve(static_cast<std::size_t>(
      std::count_if(visibilities.begin(), visibilities.end(),
                    [](const TrackVisibility& s) { return s.fraction > 0.0; })));
  const ViewWalk walk = viewWalkOf(frame);
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    Track& track = belief.tracks[j];
    if (visibilities[j].fraction <= 0.0) {
      noteNotVisible(track, visibilities[j].state, now, parameters.motion.min_speed);
      continue;
    }
    predict(track, now, input.pose_error, parameters.motion, walk);
    scored.push_back({j, scoreTrack(track, visibilities[j], boxes, frame)});
    if (admitNewClasses(track, scored.back().score, boxes, frame)) {
      scored.back().score = scoreTrack(track, visibilities[j], boxes, frame);
    }
    const auto primed = input.top_down.find(track.id);
    if (primed != input.top_down.end()) {
      applyTopDown(scored.back().score, track, primed->second, frame);
    }
  }
  return scored;
}

/// Updates the scored tracks; returns Association::explained.
Eigen::VectorXd Step::associateAndUpdate(ScratchVector<ScoredTrack>& scored) {
  const auto n = static_cast<Eigen::Index>(scored.size());
  const auto m = static_cast<Eigen::Index>(boxes.size());
  Eigen::MatrixXd psi = Eigen::MatrixXd::Zero(n, m);
  Eigen::VectorXd fresh(m);
  for (Eigen::Index z = 0; z < m; ++z) {
    fresh[z] = 1.0 + std::exp(logInitiationRatio(boxes[static_cast<std::size_t>(z)], frame));
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    const ScoredTrack& s = scored[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < s.score.boxes.size(); ++i) {
      psi(j, static_cast<Eigen::Index>(s.score.boxes[i])) =
          associationWeight(belief.tracks[s.track], s.score, i);
    }
  }
  const Association association = associate(psi, fresh);
  ScratchVector<Track*> to_refit;
  for (Eigen::Index j = 0; j < n; ++j) {
    ScoredTrack& s = scored[static_cast<std::size_t>(j)];
    Track& track = belief.tracks[s.track];
    const bool near_box =
        track.life.once_confirmed && !track.best().moving && !s.score.boxes.empty();
    if (near_box) s.before = track;
    s.assigned = update(track, s.score, association.eta.row(j), boxes, frame);
    s.sound = sound(track);
    if (s.assigned && s.sound &&
        considerKeyframe(track, boxes[*s.assigned],
                         hiddenSides(s.score, *s.assigned, boxes[*s.assigned]), frame)) {
      to_refit.push_back(&track);
    }
  }
  refitNeediest(to_refit, belief, frame);
  return association.explained;
}

/// Reduces the mixture of one track after its update. If no hypothesis remains, the frame counts as
/// a miss, or the box re-initialises the state. If both fail, existence becomes 0.
void Step::manage(Track& track, ScoredTrack& scored) {
  const auto pmf = classShares(track);
  reduceMixture(track, frame);
  if (track.hypotheses.empty() && scored.before) {
    track = updateAsMissed(*scored.before, scored.score, frame);
    if (sound(track)) reduceMixture(track, frame);
  }
  if (!track.hypotheses.empty()) return;
  if (scored.assigned) {
    const BoxDetection& box = boxes[*scored.assigned];
    const auto range = rangeFromLandmarks(box, input.points, parameters.initiation);
    if (reinitialise(track, pmf, box, range, frame)) {
      considerKeyframe(track, box, hiddenSides(scored.score, *scored.assigned, box), frame);
      reduceMixture(track, frame);
    }
  }
  if (track.hypotheses.empty()) {
    track.existence.become(0.0, ExistenceEvidence::kMisshapen, track.as_of);
  }
}

void Step::manageAll(ScratchVector<ScoredTrack>& scored) {
  std::vector<Track> lost;
  for (auto& s : scored) {
    Track& track = belief.tracks[s.track];
    if (s.sound) manage(track, s);
    if (track.hypotheses.empty() && s.before) lost.push_back(*std::move(s.before));
  }
  keepDeleted(belief.recently_deleted, std::move(lost), now, parameters.tracks);
}

void Step::resolveIdentities(StepReport& report) {
  report.merges = mergeObjects(belief.tracks, frame);
  keepDeleted(belief.recently_deleted, confirmAndDelete(belief.tracks, frame), now,
              parameters.tracks);
  const auto found = reidentify(belief.tracks, belief.recently_deleted, frame);
  report.merges.insert(report.merges.end(), found.begin(), found.end());
}

}  // namespace

bool SemanticFilter::join(Belief& belief, TrackId id, TrackId absorbed,
                          const FrameInput& input) const {
  const auto find = [&](TrackId wanted) {
    return std::find_if(belief.tracks.begin(), belief.tracks.end(),
                        [&](const Track& o) { return o.id == wanted; });
  };
  const auto kept = find(id), other = find(absorbed);
  check(kept != belief.tracks.end() && other != belief.tracks.end() && kept != other,
        "two tracks of the working set are joined");
  if (!sameKind(*kept, *other)) return false;
  if (other->id < kept->id) std::swap(*kept, *other);
  mergeTwo(*kept, *other, contextOf(belief, input, parameters_, priors_));
  kept->id = id;
  belief.tracks.erase(other);
  return true;
}

StepReport SemanticFilter::step(Belief& belief, const FrameInput& heard, IdBook& ids) const {
  const ScratchScope scope;
  StepReport report;
  belief.path.advance(heard.view.T_WB.p);
  // Visibility is published with every frame, with or without detections.
  auto visibilities = updateVisibility(belief, heard, parameters_.visibility);
  withdrawLostMovers(belief.tracks, heard, parameters_);
  if (!heard.boxes) return report;
  FrameInput input = withLearnedNoise(belief, heard, parameters_.box);
  markSidesBesideNearer(*input.boxes, input.view);
  // Partial views and revised occlusion change the meaning of boxes and misses, so they come first.
  explainPartialViews(belief, visibilities, input, parameters_, priors_);
  const FrameContext frame = contextOf(belief, input, parameters_, priors_);
  reviseOcclusion(belief, visibilities, input, parameters_);
  Step step{belief, input, frame};
  // All tracks are scored before the first update, because association compares their scores.
  auto scored = step.scoreAll(visibilities);
  const auto explained = step.associateAndUpdate(scored);
  // A track without hypotheses is re-initialised by its box before the box can initiate a new one.
  step.manageAll(scored);
  initiateTracks(belief, visibilities, explained, input, frame, ids);
  std::erase_if(belief.tracks, [](const Track& t) { return t.hypotheses.empty(); });
  report.broken = std::erase_if(belief.tracks, [](const Track& t) {
    return t.visibility.fraction > 0.0 && !sound(t);  // tracks out of view did not change
  });
  // Track management uses the detections of this frame and includes new tracks.
  for (Track& t : belief.tracks) {
    const bool visible = t.visibility.fraction > 0.0, detected = t.life.last_seen == step.now;
    t.history.add(visible, visible && detected);
    if (!detected) continue;
    belief.learned.movers.learn(t, parameters_.motion.min_speed);
    belief.learned.sizes.learn(input.model->network, std::exchange(t.detectability.proven, {}));
  }
  step.resolveIdentities(report);
  return report;
}

}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Notes a frame in which the track is not visible in its ledger.
void noteNotVisible(Track& track, Visibility why, TimePoint now, double min_speed) {
  if (track.unused.count() == 0) stopSlowHypotheses(track, min_speed);
  const bool away = why == Visibility::kOutOfView || why == Visibility::kBehind;
  LedgerEntry& entry = away ? track.unused.out_of_view : track.unused.occluded;
  if (entry.count++ == 0) entry.first = now;
  entry.last = now;
}

}  // namespace

NoiseScale SemanticFilter::noiseScaleOf(const Belief& belief, const FrameInput& input) const {
  const std::uint64_t model = input.model->hash;
  const BoxParameters& assumed = parameters_.box;
  return {model, belief.learned.sides.ratio(model, assumed.prior_sides),
          belief.learned.azimuths.ratio(model, assumed.prior_azimuths)};
}

FrameContext SemanticFilter::contextOf(const Belief& belief, const FrameInput& input) const {
  const NoiseScale noise_scale = noiseScaleOf(belief, input);
  return {input.view,
          input.pose_error,
          input.model.get(),
          &priors_,
          &parameters_,
          std::make_shared<const FrameView>(input.view, input.pose_error, input.stamp.time,
                                            input.model->styles, noise_scale),
          noise_scale,
          std::make_shared<const GroundSurface>(belief.tracks, belief.path,
                                                belief.learned.roughness_scale, input.view.up_W,
                                                priors_, parameters_.ground),
          &belief.learned.movers};
}

ScratchVector<TrackVisibility> SemanticFilter::updateVisibility(Belief& belief,
                                                                const FrameInput& input) const {
  const Projector from(input.view);
  ScratchVector<Outline> outlines;
  outlines.reserve(belief.tracks.size());
  for (const auto& o : belief.tracks) {
    outlines.push_back(
        outlineOf(o, stateAt(o.best(), toSeconds(input.stamp.time - o.as_of)), from));
  }
  const auto& camera = *input.view.camera;
  auto visibilities = computeVisibility(outlines, input.points, camera.width(), camera.height(),
                                        parameters_.visibility);
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    Track& o = belief.tracks[j];
    o.visibility.state = visibilities[j].state;
    o.visibility.fraction = visibilities[j].fraction;
    o.visibility.blocked_by = visibilities[j].blocked_by;
  }
  return visibilities;
}

ScratchVector<SemanticFilter::ScoredTrack> SemanticFilter::scoreAll(
    Belief& belief, const ScratchVector<TrackVisibility>& visibilities, const FrameInput& input,
    const FrameContext& frame) const {
  ScratchVector<ScoredTrack> scored;
  scored.reserve(static_cast<std::size_t>(
      std::count_if(visibilities.begin(), visibilities.end(),
                    [](const TrackVisibility& s) { return s.fraction > 0.0; })));
  const ViewWalk walk = viewWalkOf(frame);
  for (std::size_t j = 0; j < visibilities.size(); ++j) {
    if (visibilities[j].fraction <= 0.0) {
      noteNotVisible(belief.tracks[j], visibilities[j].state, input.stamp.time,
                     parameters_.motion.min_speed);
      continue;
    }
    predict(belief.tracks[j], input.stamp.time, input.pose_error, parameters_.motion, walk);
    scored.push_back({j, scoreTrack(belief.tracks[j], visibilities[j], *input.boxes, frame)});
    if (admitNewClasses(belief.tracks[j], scored.back().score, *input.boxes, frame)) {
      scored.back().score = scoreTrack(belief.tracks[j], visibilities[j], *input.boxes, frame);
    }
    const auto primed = input.top_down.find(belief.tracks[j].id);
    if (primed != input.top_down.end()) {
      applyTopDown(scored.back().score, belief.tracks[j], primed->second, frame);
    }
  }
  return scored;
}

Eigen::VectorXd SemanticFilter::associateAndUpdate(Belief& belief,
                                                   ScratchVector<ScoredTrack>& scored,
                                                   const FrameInput& input,
                                                   const FrameContext& frame) const {
  const auto& boxes = *input.boxes;
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

void SemanticFilter::manage(Track& track, ScoredTrack& scored, const FrameInput& input,
                            const FrameContext& frame) const {
  const auto pmf = classShares(track);
  reduceMixture(track, frame);
  if (track.hypotheses.empty() && scored.before) {
    track = updateAsMissed(*scored.before, scored.score, frame);
    if (sound(track)) reduceMixture(track, frame);
  }
  if (!track.hypotheses.empty()) return;
  if (scored.assigned) {
    const BoxDetection& box = (*input.boxes)[*scored.assigned];
    const auto range = rangeFromLandmarks(box, input.points, parameters_.initiation);
    if (reinitialise(track, pmf, box, range, frame)) {
      considerKeyframe(track, box, hiddenSides(scored.score, *scored.assigned, box), frame);
      reduceMixture(track, frame);
    }
  }
  if (track.hypotheses.empty()) {
    track.existence.become(0.0, ExistenceEvidence::kMisshapen, track.as_of);
  }
}

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
  mergeTwo(*kept, *other, contextOf(belief, input));
  kept->id = id;
  belief.tracks.erase(other);
  return true;
}

FrameInput SemanticFilter::withLearnedNoise(const Belief& belief, FrameInput input) const {
  const NoiseScale scale = noiseScaleOf(belief, input);
  for (BoxDetection& box : *input.boxes) {
    box.z.variance *= scale.noise;
    box.z.lasting *= scale.lasting();
  }
  return input;
}

void SemanticFilter::manageAll(Belief& belief, ScratchVector<ScoredTrack>& scored,
                               const FrameInput& input, const FrameContext& frame) const {
  std::vector<Track> lost;
  for (auto& s : scored) {
    Track& track = belief.tracks[s.track];
    if (s.sound) manage(track, s, input, frame);
    if (track.hypotheses.empty() && s.before) lost.push_back(*std::move(s.before));
  }
  keepDeleted(belief.recently_deleted, std::move(lost), input.stamp.time, parameters_.tracks);
}

void SemanticFilter::dropBroken(Belief& belief, StepReport& report) {
  std::erase_if(belief.tracks, [](const Track& t) { return t.hypotheses.empty(); });
  report.broken = std::erase_if(belief.tracks, [](const Track& t) {
    return t.visibility.fraction > 0.0 && !sound(t);  // the other tracks did not change
  });
}

void SemanticFilter::recordDetections(Belief& belief, TimePoint now) {
  for (Track& t : belief.tracks) {
    const bool visible = t.visibility.fraction > 0.0;
    t.history.add(visible, visible && t.life.last_seen == now);
  }
}

void SemanticFilter::resolveIdentities(Belief& belief, const FrameContext& frame, TimePoint now,
                                       StepReport& report) const {
  const auto add = [&](const std::vector<MergeRecord>& merges) {
    report.merges.insert(report.merges.end(), merges.begin(), merges.end());
  };
  add(mergeObjects(belief.tracks, frame));
  keepDeleted(belief.recently_deleted, confirmAndDelete(belief.tracks, frame), now,
              parameters_.tracks);
  add(reidentify(belief.tracks, belief.recently_deleted, frame));
}

StepReport SemanticFilter::step(Belief& belief, const FrameInput& heard, IdBook& ids) const {
  const ScratchScope scope;
  StepReport report;
  const TimePoint now = heard.stamp.time;
  belief.path.advance(heard.view.T_WB.p);
  // Visibility is published with every frame, with or without detections.
  auto visibilities = updateVisibility(belief, heard);
  if (!heard.boxes) return report;
  FrameInput input = withLearnedNoise(belief, heard);
  markSidesBesideNearer(*input.boxes, input.view);
  // Both change the meaning of a box or a miss, so they precede all scores.
  explainPartialViews(belief, visibilities, input, parameters_, priors_);
  const FrameContext frame = contextOf(belief, input);
  reviseOcclusion(belief, visibilities, input, parameters_);
  // All tracks are scored before the first update, because association compares their scores.
  auto scored = scoreAll(belief, visibilities, input, frame);
  const auto explained = associateAndUpdate(belief, scored, input, frame);
  // A track that lost its shape may take its box again before this box initiates another track.
  manageAll(belief, scored, input, frame);
  initiateTracks(belief, visibilities, explained, input, frame, ids);
  dropBroken(belief, report);
  // Track management uses the detections of this frame and includes new tracks.
  recordDetections(belief, now);
  for (const Track& t : belief.tracks) {
    if (t.life.last_seen == now) belief.learned.movers.learn(t, parameters_.motion.min_speed);
  }
  resolveIdentities(belief, frame, now, report);
  return report;
}

}  // namespace perdure::semantic_filter

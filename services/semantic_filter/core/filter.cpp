#include "services/semantic_filter/core/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/semantic_filter/core/association/joint_association.h"
#include "services/semantic_filter/core/association/occlusion_revision.h"
#include "services/semantic_filter/core/association/top_down.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/smoothing/refit.h"
#include "services/semantic_filter/core/tracks/context.h"
#include "services/semantic_filter/core/tracks/initiation.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "services/semantic_filter/core/tracks/new_classes.h"
#include "services/semantic_filter/core/tracks/reidentify.h"
#include "services/semantic_filter/core/tracks/reinitialise.h"
#include "services/semantic_filter/core/update/predict.h"
#include "services/semantic_filter/core/update/track_update.h"

namespace perdure::semantic_filter {

namespace {

/// A look that says nothing about the object, for its ledger.
void noteUnused(Object& object, Visibility why, TimePoint now, double min_speed) {
  if (object.hidden.count + object.away.count == 0) letSlowOnesStand(object, min_speed);
  const bool away = why == Visibility::kOutOfView || why == Visibility::kBehind;
  LedgerEntry& entry = away ? object.away : object.hidden;
  if (entry.count++ == 0) entry.first = now;
  entry.last = now;
}

}  // namespace

BoxErrors SemanticFilter::errorsOf(const Belief& belief, const FrameInput& input) const {
  const std::uint64_t model = input.model.hash;
  const BoxParameters& assumed = parameters_.box;
  return {model, belief.learned.sides.ratio(model, assumed.assumed_sides),
          belief.learned.azimuths.ratio(model, assumed.assumed_azimuths)};
}

FrameContext SemanticFilter::contextOf(const Belief& belief, const FrameInput& input) const {
  const BoxErrors errors = errorsOf(belief, input);
  return {input.view,
          input.pose_error,
          &input.model,
          &priors_,
          &parameters_,
          std::make_shared<const KeyView>(input.view, input.pose_error, input.stamp.time,
                                          input.model.styles, errors),
          errors,
          std::make_shared<const Ground>(belief.objects, belief.path, belief.learned.evenness,
                                         input.view.up_W, priors_, parameters_.ground)};
}

std::vector<Sight> SemanticFilter::seeAll(Belief& belief, const FrameInput& input) const {
  const Projector from(input.view);
  std::vector<Outline> outlines;
  outlines.reserve(belief.objects.size());
  for (const auto& o : belief.objects) {
    outlines.push_back(
        outlineOf(o, stateAt(o.best(), toSeconds(input.stamp.time - o.as_of)), from));
  }
  const auto& camera = *input.view.camera;
  auto sights =
      see(outlines, input.points, camera.width(), camera.height(), parameters_.visibility);
  for (std::size_t j = 0; j < sights.size(); ++j) {
    Object& o = belief.objects[j];
    o.visibility = sights[j].visibility;
    o.visible_fraction = sights[j].fraction;
    o.blocked_by = sights[j].blocked_by;
  }
  return sights;
}

std::vector<SemanticFilter::Seen> SemanticFilter::score(Belief& belief,
                                                        const std::vector<Sight>& sights,
                                                        const FrameInput& input,
                                                        const FrameContext& frame) const {
  std::vector<Seen> seen;
  seen.reserve(static_cast<std::size_t>(std::count_if(
      sights.begin(), sights.end(), [](const Sight& s) { return s.fraction > 0.0; })));
  const ViewWalk walk = viewWalkOf(frame);
  for (std::size_t j = 0; j < sights.size(); ++j) {
    if (sights[j].fraction <= 0.0) {
      noteUnused(belief.objects[j], sights[j].visibility, input.stamp.time,
                 parameters_.motion.min_speed);
      continue;
    }
    predict(belief.objects[j], input.stamp.time, input.pose_error, parameters_.motion, walk);
    seen.push_back({j, look(belief.objects[j], sights[j], *input.boxes, frame)});
    if (admitNewClasses(belief.objects[j], seen.back().look, *input.boxes, frame)) {
      seen.back().look = look(belief.objects[j], sights[j], *input.boxes, frame);
    }
    const auto primed = input.primed.find(belief.objects[j].id);
    if (primed != input.primed.end()) {
      hearPrimed(seen.back().look, belief.objects[j], primed->second, frame);
    }
  }
  return seen;
}

bool SemanticFilter::tellsPose(const Object& object, const FrameContext& frame) const {
  if (object.came_back <= std::max(object.told_pose, object.first_seen)) return false;
  const Hypothesis& best = object.best();
  return object.confirmed && !best.moving && best.weight > 0.5 &&
         (best.x.head<3>() - frame.view.T_WB.p).norm() < parameters_.drift.within_m;
}

Eigen::VectorXd SemanticFilter::associateAndUpdate(Belief& belief, std::vector<Seen>& seen,
                                                   const FrameInput& input,
                                                   const FrameContext& frame) const {
  const auto& boxes = *input.boxes;
  const auto n = static_cast<Eigen::Index>(seen.size());
  const auto m = static_cast<Eigen::Index>(boxes.size());
  Eigen::MatrixXd psi = Eigen::MatrixXd::Zero(n, m);
  Eigen::VectorXd fresh(m);
  for (Eigen::Index z = 0; z < m; ++z) {
    fresh[z] = 1.0 + std::exp(logBirthRatio(boxes[static_cast<std::size_t>(z)], frame));
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    const Seen& s = seen[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < s.look.boxes.size(); ++i) {
      psi(j, static_cast<Eigen::Index>(s.look.boxes[i])) =
          associationWeight(belief.objects[s.object], s.look, i);
    }
  }
  const Association association = associate(psi, fresh);
  std::vector<Object*> to_smooth;
  for (Eigen::Index j = 0; j < n; ++j) {
    Seen& s = seen[static_cast<std::size_t>(j)];
    Object& object = belief.objects[s.object];
    const auto before = tellsPose(object, frame) ? std::optional(object.best()) : std::nullopt;
    s.claimed = object.once_confirmed && !object.best().moving && !s.look.boxes.empty();
    s.own = update(object, s.look, association.eta.row(j), boxes, frame);
    if (before && s.own && s.look.hypotheses[0].box) {
      object.told_pose = object.as_of;
      s.told = poseEvidence(*before, *s.look.hypotheses[0].box, boxes[*s.own].z,
                            hiddenSides(s.look, *s.own), frame.pose_error.covariance);
    }
    if (s.own && sound(object) &&
        rememberLook(object, boxes[*s.own], hiddenSides(s.look, *s.own), frame)) {
      to_smooth.push_back(&object);
    }
  }
  smoothNeediest(to_smooth, belief, frame);
  return association.claimed;
}

Object SemanticFilter::untilLook(const Object& was, const Object& now, const Seen& seen,
                                 const FrameInput& input, const FrameContext& frame) const {
  Object object = was;
  object.visibility = now.visibility;
  object.visible_fraction = now.visible_fraction;
  object.blocked_by = now.blocked_by;
  predict(object, input.stamp.time, input.pose_error, parameters_.motion, viewWalkOf(frame));
  const ObjectLook first = look(object, seen.look.sight, *input.boxes, frame);
  admitNewClasses(object, first, *input.boxes, frame);
  return object;
}

void SemanticFilter::tend(Object& object, const Object& was, Seen& seen, const FrameInput& input,
                          const FrameContext& frame) const {
  const auto pmf = classShares(object);
  tendHypotheses(object, priors_, parameters_);
  if (object.hypotheses.empty() && seen.claimed) {
    object = missed(untilLook(was, object, seen, input, frame), seen.look, frame);
    seen.told.reset();
    if (sound(object)) tendHypotheses(object, priors_, parameters_);
  }
  if (!object.hypotheses.empty()) return;
  if (seen.own) {
    const Evidence& box = (*input.boxes)[*seen.own];
    const auto range = rangeFromLandmarks(box, input.points, parameters_.birth);
    if (bearAgain(object, pmf, box, range, frame)) {
      rememberLook(object, box, hiddenSides(seen.look, *seen.own), frame);
      tendHypotheses(object, priors_, parameters_);
    }
  }
  if (object.hypotheses.empty()) {
    object.existence.become(0.0, ExistenceEvidence::kMisshapen, object.as_of);
  }
}

std::optional<MergeRecord> SemanticFilter::join(Belief& belief, ObjectId id, ObjectId absorbed,
                                                const FrameInput& input) const {
  const auto find = [&](ObjectId wanted) {
    return std::find_if(belief.objects.begin(), belief.objects.end(),
                        [&](const Object& o) { return o.id == wanted; });
  };
  const auto kept = find(id), other = find(absorbed);
  if (kept == belief.objects.end() || other == belief.objects.end() || kept == other) {
    return std::nullopt;
  }
  if (!sameKind(*kept, *other)) return std::nullopt;
  mergeTwo(*kept, *other, contextOf(belief, input));
  belief.objects.erase(other);
  return MergeRecord{id, absorbed};
}

StepReport SemanticFilter::step(const Belief& before, Belief& belief, const FrameInput& heard,
                                IdBook& ids) const {
  belief.path.go(heard.view.T_WB.p);
  auto sights = seeAll(belief, heard);
  if (!heard.boxes) return {};
  FrameInput input = heard;
  const BoxErrors errors = errorsOf(belief, heard);
  for (Evidence& box : *input.boxes) {
    box.z.variance *= errors.noise;
    box.z.lasting *= errors.lasting();
  }
  explainRemnants(belief, sights, input, parameters_, priors_);
  const FrameContext frame = contextOf(belief, input);
  reveal(belief, sights, input, parameters_);
  auto seen = score(belief, sights, input, frame);
  StepReport report;
  const auto claimed = associateAndUpdate(belief, seen, input, frame);
  std::vector<Object> lost;
  for (auto& s : seen) {
    Object& object = belief.objects[s.object];
    const Object& was = before.objects[s.object];
    if (sound(object)) tend(object, was, s, input, frame);
    if (object.hypotheses.empty() && s.claimed) {
      lost.push_back(untilLook(was, object, s, input, frame));
    }
    if (s.told) report.pose.push_back(*s.told);
  }
  rememberGone(belief.gone, std::move(lost), input.stamp.time, parameters_.tend);
  births(belief, sights, claimed, input, frame, ids);
  std::erase_if(belief.objects, [](const Object& o) { return o.hypotheses.empty(); });
  report.broken = std::erase_if(belief.objects, [](const Object& o) { return !sound(o); });
  for (Object& o : belief.objects) {
    const bool in_sight = o.visible_fraction > 0.0;
    o.sightings.add(in_sight, in_sight && o.last_seen == input.stamp.time);
  }
  report.merges = mergeObjects(belief.objects, frame);
  const auto moved = reuniteMoved(belief.objects, frame);
  report.merges.insert(report.merges.end(), moved.begin(), moved.end());
  rememberGone(belief.gone, confirmAndBury(belief.objects, frame), input.stamp.time,
               parameters_.tend);
  const auto found = findAgain(belief.objects, belief.gone, frame);
  report.merges.insert(report.merges.end(), found.begin(), found.end());
  contextualise(belief.objects, priors_.context);
  return report;
}

}  // namespace perdure::semantic_filter

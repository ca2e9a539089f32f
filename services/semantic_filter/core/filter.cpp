#include "services/semantic_filter/core/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/semantic_filter/core/association/joint_association.h"
#include "services/semantic_filter/core/tracks/context.h"
#include "services/semantic_filter/core/tracks/reidentify.h"
#include "services/semantic_filter/core/tracks/new_classes.h"
#include "services/semantic_filter/core/association/top_down.h"
#include "services/semantic_filter/core/tracks/reinitialise.h"
#include "services/semantic_filter/core/smoothing/refit.h"
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

/// How much another look of the same detector at one object may overlap with its box.
bool sameThing(const BoxMeasurement& a, const BoxMeasurement& b) {
  const Box box_a{a.sides[0], a.sides[1], a.sides[2], a.sides[3]};
  const Box box_b{b.sides[0], b.sides[1], b.sides[2], b.sides[3]};
  return intersectionOverUnion(box_a, box_b) > 0.65;
}

constexpr double kMisjudged = 3.0;  // nats, against that the blocker is not where it was thought

}  // namespace

/// What a frame expects of each object's best hypothesis; worked out when first asked for.
class Expected {
 public:
  Expected(const Belief& belief, const FrameInput& input, const Parameters& parameters)
      : belief_(belief),
        input_(input),
        from_(input.view),
        parameters_(parameters.box),
        clutter_(parameters.clutter),
        at_(belief.objects.size()) {}

  bool matches(std::size_t j, const std::array<bool, 4>& hidden, const Evidence& box) {
    return fit(j, hidden, box).has_value();
  }

  /// log of how well it explains the box, sides and class, against clutter.
  std::optional<double> fit(std::size_t j, const std::array<bool, 4>& hidden, const Evidence& box) {
    const Entry& e = entryOf(j);
    if (!e.box || !mayOverlap(box.z, *e.box, e.covariance)) return std::nullopt;
    const auto score = scoreBox(box.z, *e.box, e.covariance, hidden, parameters_);
    if (!score) return std::nullopt;
    const Object& object = belief_.objects[j];
    return score->log_density - logClutterOf(box, *score, input_.view, clutter_) +
           logRatio(box, input_.model, object.best().class_name, object.alike);
  }

 private:
  struct Entry {
    bool known = false;
    std::optional<ProjectedBox> box;
    Eigen::Matrix4d covariance;
  };

  const Entry& entryOf(std::size_t j) {
    Entry& e = at_[j];
    if (e.known) return e;
    e.known = true;
    const Object& object = belief_.objects[j];
    const Hypothesis& best = object.best();
    const State x = stateAt(best, toSeconds(input_.stamp.time - object.as_of));
    e.box = projectObserved(x, from_, input_.model.styles->of(best.class_name), best.facing());
    if (e.box) e.covariance = predictedCovariance(best, *e.box, input_.pose_error.covariance);
    return e;
  }

  const Belief& belief_;
  const FrameInput& input_;
  Projector from_;
  const BoxParameters& parameters_;
  const ClutterParameters& clutter_;
  std::vector<Entry> at_;
};

ObjectId IdBook::idFor(std::uint64_t frame_sequence, std::size_t box) {
  const auto [it, fresh] = given_.try_emplace({frame_sequence, box}, next_);
  if (fresh) ++next_;
  return it->second;
}

void IdBook::forgetBefore(std::uint64_t frame_sequence) {
  given_.erase(given_.begin(), given_.lower_bound({frame_sequence, 0}));
}

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

/// As many as a frame has time for; the others wait.
void SemanticFilter::smoothNeediest(std::vector<Object*>& objects, Belief& belief,
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

void SemanticFilter::reveal(Belief& belief, std::vector<Sight>& sights,
                            const FrameInput& input) const {
  std::vector<std::size_t> hidden;
  for (std::size_t j = 0; j < sights.size(); ++j) {
    const bool solid = belief.objects[j].existence >= parameters_.visibility.solid;
    if (solid && sights[j].visibility == Visibility::kOccluded) hidden.push_back(j);
  }
  if (hidden.empty()) return;
  Expected expected(belief, input, parameters_);
  for (const auto& e : *input.boxes) {
    std::vector<std::size_t> may_be;
    double best_hidden = -std::numeric_limits<double>::infinity();
    for (const std::size_t j : hidden) {
      const auto fit = expected.fit(j, {}, e);
      if (!fit) continue;
      may_be.push_back(j);
      best_hidden = std::max(best_hidden, *fit);
    }
    bool others = may_be.empty();
    for (std::size_t j = 0; j < sights.size() && !others; ++j) {
      if (sights[j].fraction <= 0.0) continue;
      const auto fit = expected.fit(j, sights[j].hidden, e);
      others = fit && *fit > best_hidden - kMisjudged;
    }
    if (others) continue;
    for (const std::size_t j : may_be) {
      sights[j].hidden = {};
      sights[j].fraction = parameters_.visibility.minimum;
      sights[j].visibility = Visibility::kPartial;
      belief.objects[j].visibility = Visibility::kPartial;
      belief.objects[j].visible_fraction = sights[j].fraction;
    }
  }
}

void SemanticFilter::explainRemnants(const Belief& belief, const std::vector<Sight>& sights,
                                     FrameInput& input) const {
  std::vector<std::pair<std::size_t, double>> remnants;  // and how surely each is found
  for (std::size_t j = 0; j < sights.size(); ++j) {
    if (sights[j].remnant <= 0.0) continue;
    const Object& o = belief.objects[j];
    const double found = priors_.of(o.best().class_name).detection_probability;
    remnants.emplace_back(j, o.existence * sights[j].remnant * found);
  }
  if (remnants.empty()) return;
  Expected expected(belief, input, parameters_);
  for (Evidence& box : *input.boxes) {
    double boxes = 0.0;
    for (const auto& [j, found] : remnants) {
      const auto fit = expected.fit(j, sights[j].hidden, box);
      if (fit) boxes += found * std::exp(*fit);
    }
    box.log_remnants = std::log1p(boxes);
  }
}

bool SemanticFilter::leavesView(Expected& expected, const Belief& belief,
                                const std::vector<Sight>& sights, const Evidence& box) {
  if (box.z.count() == 4) return false;  // what leaves is cut by the border
  for (std::size_t j = 0; j < sights.size(); ++j) {
    if (sights[j].visibility != Visibility::kOutOfView || !belief.objects[j].confirmed) continue;
    if (expected.matches(j, sights[j].hidden, box)) return true;
  }
  return false;
}

void SemanticFilter::births(Belief& belief, const std::vector<Sight>& sights,
                            const Eigen::VectorXd& claimed, const FrameInput& input,
                            const FrameContext& frame, IdBook& ids) const {
  const auto& boxes = *input.boxes;
  std::vector<Object> born;
  Expected expected(belief, input, parameters_);
  std::vector<std::size_t> accepted;
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    if (claimed[static_cast<Eigen::Index>(z)] > parameters_.birth.claimed) accepted.push_back(z);
  }
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    const Evidence& e = boxes[z];
    if (claimed[static_cast<Eigen::Index>(z)] > parameters_.birth.claimed) continue;
    if (logBirthRatio(e, frame) - std::log(parameters_.birth.odds) <
        parameters_.birth.min_log_ratio) {
      continue;
    }
    const bool doubled = std::any_of(accepted.begin(), accepted.end(), [&](std::size_t other) {
      return sameThing(boxes[other].z, e.z);
    });
    if (doubled || leavesView(expected, belief, sights, e)) continue;
    auto object =
        bear(e, rangeFromLandmarks(e, input.points, parameters_.birth), input.stamp.time, frame);
    if (!object) continue;
    object->id = ids.idFor(input.stamp.sequence, z);
    if (const double share = claimed[static_cast<Eigen::Index>(z)]; share > 0.0) {
      object->existence.become(object->existence * (1.0 - share), ExistenceEvidence::kShared,
                               input.stamp.time);
    }
    tendHypotheses(*object, priors_, parameters_);
    if (object->hypotheses.empty()) continue;
    born.push_back(std::move(*object));
    accepted.push_back(z);
  }
  std::move(born.begin(), born.end(), std::back_inserter(belief.objects));
  const auto older = [](const auto& a, const auto& b) { return a.id < b.id; };
  if (!std::is_sorted(belief.objects.begin(), belief.objects.end(), older)) {
    std::stable_sort(belief.objects.begin(), belief.objects.end(), older);
  }
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
  explainRemnants(belief, sights, input);
  const FrameContext frame = contextOf(belief, input);
  reveal(belief, sights, input);
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

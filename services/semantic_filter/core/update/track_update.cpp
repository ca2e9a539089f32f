#include "services/semantic_filter/core/update/track_update.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/association/tempering.h"
#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/update/azimuth_update.h"
#include "services/semantic_filter/core/update/class_existence.h"
#include "services/semantic_filter/core/update/ekf.h"

namespace perdure::semantic_filter {

namespace {

Shares sharesOf(const HypothesisLook& h, const std::vector<std::size_t>& looked_at,
                const Eigen::VectorXd& eta) {
  Shares shares;
  shares.A = h.silent;
  shares.box.reserve(looked_at.size());
  for (std::size_t i = 0; i < looked_at.size(); ++i) {
    const double free = eta[static_cast<Eigen::Index>(looked_at[i])];
    shares.box.push_back(h.detection * free * h.fits[i].likelihood);
    shares.A += shares.box.back();
  }
  for (auto& b : shares.box) b /= shares.A;
  shares.none = h.silent / shares.A;
  return shares;
}

void updateState(Hypothesis& h, const Shares& shares, const ObjectLook& look,
                 const HypothesisLook& seen, const std::vector<Evidence>& boxes, double repeated,
                 const FrameContext& frame) {
  const ProjectedBox* at_prior = seen.box ? &*seen.box : nullptr;
  thread_local std::vector<Hypothesis> parts;
  parts.clear();
  for (std::size_t i = 0; i < shares.box.size(); ++i) {
    if (shares.box[i] < kNegligible) continue;
    const BoxMeasurement& z = boxes[look.boxes[i]].z;
    auto hidden = look.sight.hidden;
    const int part = seen.fits[i].part;
    if (part >= 0) hidden[static_cast<std::size_t>(part)] = true;
    parts.push_back(updateWithBox(h, z, hidden, repeated, frame, at_prior));
    parts.back().weight = shares.box[i];
  }
  if (parts.empty()) return;
  const double weight = h.weight;
  mix(h, shares.none, parts);
  h.weight = weight;
}

/// Probability that one of the boxes is the object's, given that it exists.
double probabilitySeen(const Object& object, const std::vector<Shares>& shares) {
  double seen = 0.0, total = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double weight = object.hypotheses[i].weight * shares[i].A;
    seen += weight * (1.0 - shares[i].none);
    total += weight;
  }
  return total > 0.0 ? seen / total : 0.0;
}

/// The box of the look that is the object's beyond reasonable doubt.
std::optional<std::size_t> surelyOwn(const Object& object, const std::vector<Shares>& shares) {
  constexpr double kSurely = 0.8;
  double total = 0.0;
  std::vector<double> box(shares.empty() ? 0 : shares.front().box.size(), 0.0);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double weight = object.hypotheses[i].weight * shares[i].A;
    total += weight;
    for (std::size_t z = 0; z < box.size(); ++z) box[z] += weight * shares[i].box[z];
  }
  const auto best = std::max_element(box.begin(), box.end());
  if (best == box.end() || *best < kSurely * total || total <= 0.0) return std::nullopt;
  return static_cast<std::size_t>(best - box.begin());
}

void count(Object& object, double seen, const std::vector<Shares>& shares, const ObjectLook& look) {
  const double visible = std::min(1.0, look.sight.fraction);
  object.support += 0.25 * visible * (seen - object.support);
  if (seen < 0.5) {
    ++object.visible_misses;
    return;
  }
  ++object.hits;
  const bool from_map =
      object.recalled && toSeconds(object.as_of - object.last_seen) > kAnotherVisit_s;
  object.found_again = object.found_again || from_map || object.came_back > object.first_seen;
  object.recalled = false;
  object.last_seen = object.as_of;
  const auto& box = shares.front().box;
  const auto z = std::max_element(box.begin(), box.end()) - box.begin();
  if (!box.empty() && box[z] > 0.5) {
    object.running_nis = 0.85 * object.running_nis +
                         0.15 * look.hypotheses.front().fits[static_cast<std::size_t>(z)].nis;
  }
}

void countFound(Object& object, const ObjectLook& look, bool found, const FrameContext& frame) {
  const Aspect from = aspectOf(object.best().x.head<3>(), frame.view.T_WC());
  object.found_rate.add(from, look.hypotheses.front().expected, found,
                        screenScales(frame.parameters->visibility));
}

/// By how much the noise of a look counts more because the last look had almost the same: that of
/// a stationary process of first order, whose correlation fades with the view.
double repetition(const Object& object, const FrameContext& frame) {
  if (object.hit_view.looks <= 0.0) return 1.0;
  const double scale = frame.parameters->box.noise_view;
  const double change = viewChange(object.best().x.head<3>(), object.hit_view.T_WC,
                                   frame.view.T_WC(), {scale, scale, 0.5 * scale});
  const double correlation = std::exp(-change);
  return (1.0 + correlation) / std::max(1.0 - correlation, 1e-6);
}

/// What a look is worth beside earlier ones. How much the view has changed depends on how far the
/// object is: that is asked of the hypothesis that explains the look best.
struct Worth {
  double worth = 1.0, looks = 0.0;
};

Worth worthOf(const Object& object, const ObjectLook& look, const std::vector<Shares>& shares,
              double correlation) {
  std::size_t best = 0;
  const auto posterior = [&](std::size_t i) { return object.hypotheses[i].weight * shares[i].A; };
  for (std::size_t i = 1; i < shares.size(); ++i) {
    if (posterior(i) > posterior(best)) best = i;
  }
  const double looks = look.hypotheses[best].late_looks;
  return {worthOfLook(looks, correlation), looks};
}

}  // namespace

std::optional<std::size_t> update(Object& object, const ObjectLook& look,
                                  const Eigen::VectorXd& eta, const std::vector<Evidence>& boxes,
                                  const FrameContext& frame) {
  if (look.sight.fraction <= 0.0) return std::nullopt;
  std::vector<Shares> shares;
  shares.reserve(look.hypotheses.size());
  for (const auto& h : look.hypotheses) shares.push_back(sharesOf(h, look.boxes, eta));
  const double seen = probabilitySeen(object, shares);
  const Worth hit = worthOf(object, look, shares, frame.parameters->looks.correlation);
  const auto own = surelyOwn(object, shares);
  count(object, seen, shares, look);
  const double repeated = repetition(object, frame);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    updateState(object.hypotheses[i], shares[i], look, look.hypotheses[i], boxes, repeated, frame);
  }
  const LookReasons reasons =
      reasonsOf(object, shares, seen, hit.worth, hit.worth, look.boxes, boxes, frame);
  const double r = object.existence;
  double next = weigh(object, shares, hit.worth, seen >= 0.5, *frame.parameters);
  if (seen >= 0.5) {
    object.seen_existence = next;
  } else if (look.primed) {
    next = std::min(next, std::max(r, object.seen_existence));
  }
  bookExistence(object, next, reasons);
  if (!look.primed && !object.best().moving) countFound(object, look, seen >= 0.5, frame);
  updateAzimuths(object, shares, hit.worth, look.boxes, boxes, frame);
  if (own) {
    const Evidence& box = boxes[look.boxes[*own]];
    object.last_box = OwnBox{object.as_of, box.z.box()};
    object.alike += hit.worth * box.log_ratio_best;
    object.resembles = classSeenIn(box, *frame.model);
  }
  if (seen >= 0.5) object.hit_view = {frame.view.T_WC(), 1.0 + hit.looks};
  if (seen >= 0.5 || !look.primed) {  // to be asked again is no look of its own
    object.late_view = {frame.view.T_WC(), hit.looks + std::min(1.0, look.sight.fraction)};
  }
  if (sound(object)) bookClasses(object, reasons);
  return own ? std::optional(look.boxes[*own]) : std::nullopt;
}

Object missed(Object object, ObjectLook look, const FrameContext& frame) {
  look.boxes.clear();
  update(object, look, {}, {}, frame);
  return object;
}

}  // namespace perdure::semantic_filter

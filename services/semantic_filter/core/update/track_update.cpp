#include "services/semantic_filter/core/update/track_update.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/small_products.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/azimuth.h"
#include "services/semantic_filter/core/update/class_existence.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNegligible = 0.01;  // share of a box in an update
constexpr double kMaxHead = 6.0;      // nats

using SideRows = Eigen::Matrix<double, 4, kVelocity>;  // no side depends on the velocity
using Gains = Eigen::Matrix<double, kStateDim, 4>;

/// The sides that take part; the others have a residual and derivatives of 0.
struct Innovation {
  Eigen::Vector4d residual = Eigen::Vector4d::Zero(), variance = Eigen::Vector4d::Ones();
  SideRows H = SideRows::Zero();
  Eigen::Matrix<double, 4, 6> H_pose = Eigen::Matrix<double, 4, 6>::Zero();
  int count = 0;
};

/// Measured sides, and those cut sides whose prediction wrongly ends inside the cut.
Innovation innovation(const BoxMeasurement& z, const ProjectedBox& p,
                      const std::array<bool, 4>& hidden) {
  Innovation y;
  const auto use = comparableSides(z, p, hidden);
  for (int i = 0; i < 4; ++i) {
    const double inside = i < 2 ? p.sides[i] - z.sides[i] : z.sides[i] - p.sides[i];
    if (!use[i] && !(p.exact[i] && inside > 0.0)) continue;
    y.residual[i] = z.sides[i] - p.sides[i];
    y.variance[i] = z.variance[i];
    y.H.row(i) = p.H.row(i).head<kVelocity>();
    y.H_pose.row(i) = p.H_pose.row(i);
    ++y.count;
  }
  return y;
}

/// K = W L⁻¹ with S = L Lᵀ and W = (P Hᵀ + C H_gᵀ) L⁻ᵀ, so that K S Kᵀ = W Wᵀ.
struct Gain {
  Gains W;
  Eigen::Matrix4d L;
};

/// Nothing where S is not positive definite. `PHt` is P Hᵀ + C H_gᵀ, `S` without R.
std::optional<Gain> gainOf(const Gains& PHt, const Eigen::Matrix4d& S,
                           const Eigen::Vector4d& variance) {
  Gain gain{PHt, S};
  gain.L.diagonal() += variance;
  if (!choleskyInPlace(gain.L)) return std::nullopt;
  whitenRows(gain.L, gain.W);
  return gain;
}

/// How much the noise of an outlier is widened: the weight of a t distribution, inverted.
double doubtOf(const Innovation& y, const Eigen::Matrix4d& L, double tail) {
  Eigen::Vector4d whitened = y.residual;
  whiten(L, whitened);
  return std::max(1.0, (tail + whitened.squaredNorm()) / (tail + y.count));
}

/// Moment match of "no box" and each box by their shares, which are the parts' weights (the second
/// half of PDA).
void mix(Hypothesis& none, double share_none, std::vector<Hypothesis>& parts) {
  const bool negligible = share_none <= kNegligible;
  Hypothesis& result = negligible ? parts.front() : none;
  if (!negligible) result.weight = share_none;
  for (Hypothesis& part : parts) {
    if (&part != &result) mergeInto(result, part);
  }
  if (negligible) none = std::move(result);
}

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

// The errors of azimuths are less alike from look to look than those of boxes: their exponent is
// the square root of the look's worth.

/// Within each (class, static or moving) the azimuth may weigh the yaw modes; never across, so that
/// neither existence nor class nor motion can learn from it.
void weighYawModes(Object& object, const std::vector<double>& likelihood) {
  std::map<std::pair<std::string, bool>, std::pair<double, double>> totals;
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    const auto& h = object.hypotheses[i];
    auto& [before, after] = totals[{h.class_name, h.moving}];
    before += h.weight;
    after += h.weight * likelihood[i];
  }
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    auto& h = object.hypotheses[i];
    const auto& [before, after] = totals[{h.class_name, h.moving}];
    if (after > 0.0) h.weight *= likelihood[i] * before / after;
  }
}

void updateAzimuths(Object& object, const std::vector<Shares>& shares, double worth,
                    const std::vector<std::size_t>& looked_at, const std::vector<Evidence>& boxes,
                    const FrameContext& frame) {
  const bool any = std::any_of(looked_at.begin(), looked_at.end(),
                               [&](std::size_t z) { return boxes[z].azimuth.has_value(); });
  if (!any) return;
  std::vector<double> likelihood(object.hypotheses.size(), 1.0);
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    const ClassPrior& prior = frame.priors->of(object.hypotheses[i].class_name);
    if (!prior.has_yaw) continue;
    for (std::size_t b = 0; b < looked_at.size(); ++b) {
      const Evidence& box = boxes[looked_at[b]];
      if (!box.azimuth || shares[i].box[b] < 0.2) continue;
      const double sigma = azimuthSigma(box.azimuth_sigma, prior);
      const double weight = shares[i].box[b] * std::sqrt(worth);
      likelihood[i] *= std::pow(
          updateWithAzimuth(object.hypotheses[i], *box.azimuth, sigma, weight, frame), weight);
    }
  }
  weighYawModes(object, likelihood);
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

Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repeated,
                         const FrameContext& frame, const ProjectedBox* at_prior) {
  const Matrix6d& P_pose = frame.pose_error.covariance;
  State x = prior.x;
  double doubt = 1.0;
  Eigen::Matrix<double, 4, 6> pose, pose_of_gain;
  std::optional<Gain> gain;
  for (std::int64_t i = 0; i < frame.parameters->box.iterations; ++i) {
    std::optional<ProjectedBox> box;
    if (i > 0 || !at_prior) {
      box = projectObserved(x, frame.projector(), frame.styleOf(prior.class_name), prior.facing());
      if (!box) break;
    }
    Innovation now = innovation(z, box ? *box : *at_prior, hidden);
    if (now.count == 0) break;
    now.variance *= repeated * doubt;
    const Gains PHt = leftTimesTransposed(prior.P, now.H) + timesTransposed(prior.C, now.H_pose);
    pose = timesTop<6>(now.H, prior.C) + timesTop<6>(now.H_pose, P_pose);
    const Eigen::Matrix4d S = timesTop<4>(now.H, PHt) + timesTransposed(now.H_pose, pose);
    auto next_gain = gainOf(PHt, S, now.variance);
    if (i == 0 && next_gain) {
      doubt = doubtOf(now, next_gain->L, frame.parameters->box.tail);
      now.variance *= doubt;
      if (doubt > 1.0) next_gain = gainOf(PHt, S, now.variance);
    }
    if (!next_gain) break;
    State back = prior.x - x;
    back[kYaw] = wrapAngle(back[kYaw]);
    Eigen::Vector4d whitened = now.residual - now.H.lazyProduct(back.head<kVelocity>());
    whiten(next_gain->L, whitened);
    State next = prior.x + next_gain->W * whitened;
    next[kYaw] = wrapAngle(next[kYaw]);
    if (!next.allFinite()) break;
    const double step = (next.head<3>() - x.head<3>()).norm();
    x = next;
    pose_of_gain = pose;
    gain = next_gain;
    if (step < 0.01) break;
  }
  Hypothesis posterior = prior;
  if (!gain) return posterior;
  posterior.x = x;
  posterior.P -= timesTransposed(gain->W, gain->W);
  Eigen::Matrix<double, 6, 4> whitened = pose_of_gain.transpose();
  whitenRows(gain->L, whitened);
  posterior.C -= timesTransposed(gain->W, whitened);
  return posterior;
}

double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame) {
  const AzimuthLook look = azimuthLook(azimuth, h.x, frame.view, sigma * sigma + h.P(kYaw, kYaw));
  h.head = std::clamp(h.head + weight * headOdds(look), -kMaxHead, kMaxHead);
  const double R = sigma * sigma / std::max(weight * look.inlier, 1e-9);
  const double S = h.P(kYaw, kYaw) + R;
  const State K = h.P.col(kYaw) / S;
  h.x += K * look.residual;
  h.P = (h.P - S * K * K.transpose()).eval();
  h.C = (h.C - K * h.C.row(kYaw)).eval();
  if (h.head < 0.0) {
    h.head = -h.head;
    h.x[kYaw] += M_PI;
  }
  h.x[kYaw] = wrapAngle(h.x[kYaw]);
  makeSymmetric(h.P);
  return look.likelihood;
}

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

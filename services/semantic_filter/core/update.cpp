#include "services/semantic_filter/core/update.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNegligible = 0.01;     // share of a box in an update
constexpr double kAzimuthOutlier = 0.2;  // share of azimuths that say nothing
constexpr double kAzimuthFlip = 0.1;     // share of azimuths that are turned by 180°
constexpr double kMaxHead = 6.0;         // nats

/// Rows of the measurement that take part, stacked.
struct Innovation {
  Eigen::VectorXd residual, variance;
  Eigen::MatrixXd H, H_pose;
};

/// Measured sides, and those cut sides whose prediction wrongly ends inside the cut.
Innovation innovation(const BoxMeasurement& z, const ProjectedBox& p,
                      const std::array<bool, 4>& hidden) {
  std::vector<int> rows;
  const auto use = comparableSides(z, p, hidden);
  for (int i = 0; i < 4; ++i) {
    const double inside = i < 2 ? p.sides[i] - z.sides[i] : z.sides[i] - p.sides[i];
    if (use[i] || (p.exact[i] && inside > 0.0)) rows.push_back(i);
  }
  Innovation result;
  const auto n = static_cast<Eigen::Index>(rows.size());
  result.residual.resize(n);
  result.variance.resize(n);
  result.H.resize(n, kStateDim);
  result.H_pose.resize(n, 6);
  for (Eigen::Index a = 0; a < n; ++a) {
    result.residual[a] = z.sides[rows[a]] - p.sides[rows[a]];
    result.variance[a] = z.variance[rows[a]];
    result.H.row(a) = p.H.row(rows[a]);
    result.H_pose.row(a) = p.H_pose.row(rows[a]);
  }
  return result;
}

struct Gain {
  Eigen::MatrixXd K, S;
};

Gain gainOf(const Hypothesis& h, const Innovation& y, const Matrix6d& P_pose) {
  const Eigen::MatrixXd PHt = h.P * y.H.transpose() + h.C * y.H_pose.transpose();
  Gain gain;
  gain.S =
      y.H * PHt + y.H_pose * (h.C.transpose() * y.H.transpose() + P_pose * y.H_pose.transpose());
  gain.S.diagonal() += y.variance;
  makeSymmetric(gain.S);
  gain.K = solveSymmetric(gain.S, PHt.transpose()).transpose();
  return gain;
}

/// How much the noise of an outlier is widened: the weight of a t distribution, inverted.
double doubtOf(const Innovation& y, const Eigen::MatrixXd& S, double tail) {
  const double nis = squaredMahalanobis(y.residual, S);
  return std::max(1.0, (tail + nis) / (tail + static_cast<double>(y.residual.size())));
}

/// Moment match of "no box" and each box by their shares (the second half of PDA).
Hypothesis mix(const Hypothesis& none, double share_none,
               const std::vector<std::pair<double, Hypothesis>>& parts) {
  Hypothesis result = none;
  result.weight = share_none;
  if (share_none <= kNegligible) {
    result = parts.front().second;
    result.weight = parts.front().first;
  } else if (!parts.empty()) {
    Hypothesis first = parts.front().second;
    first.weight = parts.front().first;
    mergeInto(result, first);
  }
  for (std::size_t i = 1; i < parts.size(); ++i) {
    Hypothesis part = parts[i].second;
    part.weight = parts[i].first;
    mergeInto(result, part);
  }
  return result;
}

Shares sharesOf(const HypothesisLook& h, const Eigen::VectorXd& eta) {
  Shares shares;
  shares.A = 1.0 - h.detection;
  for (std::size_t z = 0; z < h.likelihood.size(); ++z) {
    shares.box.push_back(h.detection * eta[static_cast<Eigen::Index>(z)] * h.likelihood[z]);
    shares.A += shares.box.back();
  }
  for (auto& b : shares.box) b /= shares.A;
  shares.none = (1.0 - h.detection) / shares.A;
  return shares;
}

void updateState(Hypothesis& h, const Shares& shares, const ObjectLook& look,
                 const std::vector<Evidence>& boxes, double repeated, const FrameContext& frame) {
  std::vector<std::pair<double, Hypothesis>> parts;
  for (std::size_t z = 0; z < boxes.size(); ++z) {
    if (shares.box[z] < kNegligible) continue;
    parts.emplace_back(shares.box[z],
                       updateWithBox(h, boxes[z].z, look.sight.hidden, repeated, frame));
  }
  if (parts.empty()) return;
  const double weight = h.weight;
  h = mix(h, shares.none, parts);
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
                    const std::vector<Evidence>& boxes, const FrameContext& frame) {
  std::vector<double> likelihood(object.hypotheses.size(), 1.0);
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    const ClassPrior prior = frame.priors->of(object.hypotheses[i].class_name);
    if (!prior.has_yaw) continue;
    for (std::size_t z = 0; z < boxes.size(); ++z) {
      if (!boxes[z].azimuth || shares[i].box[z] < 0.2) continue;
      const double sigma = std::max(boxes[z].azimuth_sigma, prior.azimuth_sigma);
      const double weight = shares[i].box[z] * std::sqrt(worth);
      likelihood[i] *= std::pow(
          updateWithAzimuth(object.hypotheses[i], *boxes[z].azimuth, sigma, weight, frame), weight);
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

/// The box that is the object's beyond reasonable doubt.
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
  object.recalled = false;
  object.last_seen = object.as_of;
  const auto& box = shares.front().box;
  const auto z = std::max_element(box.begin(), box.end()) - box.begin();
  if (box[z] > 0.5) {
    object.running_nis = 0.85 * object.running_nis + 0.15 * look.hypotheses.front().nis[z];
  }
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
  const double looks = look.hypotheses[best].hit_looks;
  return {worthOfLook(looks, correlation), looks};
}

/// π ∝ π A. Within a class the hypotheses differ by geometry alone, whose shared errors are in the
/// state: A counts in full there. Between classes, and for existence, looks share what the network
/// mistakes: A counts by the look's worth. Returns the mean of A over the prior, by that exponent.
/// A frame that does not show the object says that it is screened, too: P(frame | screened) is 1.
double weigh(Object& object, const std::vector<Shares>& shares, double worth) {
  std::map<std::string, std::pair<double, double>> classes;  // weight, Σ w A
  double mean_A = 0.0, tempered_A = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    auto& [weight, sum] = classes[object.hypotheses[i].class_name];
    weight += object.hypotheses[i].weight;
    sum += object.hypotheses[i].weight * shares[i].A;
  }
  for (const auto& [name, c] : classes) {
    if (c.first <= 0.0) continue;
    mean_A += c.second;
    tempered_A += c.first * std::pow(c.second / c.first, worth);
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const auto& [weight, sum] = classes[object.hypotheses[i].class_name];
    if (weight > 0.0) {
      object.hypotheses[i].weight *= shares[i].A * std::pow(sum / weight, worth - 1.0);
    }
  }
  object.screened = std::min(1.0, object.screened / mean_A);
  return tempered_A;
}

}  // namespace

Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repeated,
                         const FrameContext& frame) {
  Hypothesis posterior = prior;
  State x = prior.x;
  double doubt = 1.0;
  for (std::int64_t i = 0; i < frame.parameters->box.iterations; ++i) {
    const auto box = projectObserved(x, frame.view, frame.offsetOf(prior.class_name));
    if (!box) break;
    Innovation y = innovation(z, *box, hidden);
    if (y.residual.size() == 0) break;
    y.variance *= repeated;
    Gain gain = gainOf(prior, y, frame.pose_error.covariance);
    if (i == 0) doubt = doubtOf(y, gain.S, frame.parameters->box.tail);
    if (doubt > 1.0) {
      y.variance *= doubt;
      gain = gainOf(prior, y, frame.pose_error.covariance);
    }
    State back = prior.x - x;
    back[kYaw] = wrapAngle(back[kYaw]);
    State next = prior.x + gain.K * (y.residual - y.H * back);
    next[kYaw] = wrapAngle(next[kYaw]);
    if (!next.allFinite()) break;
    const double step = (next.head<3>() - x.head<3>()).norm();
    x = next;
    posterior.x = x;
    posterior.P = prior.P - gain.K * gain.S * gain.K.transpose();
    posterior.C = prior.C - gain.K * (y.H * prior.C + y.H_pose * frame.pose_error.covariance);
    if (step < 0.01) break;
  }
  makeSymmetric(posterior.P);
  return posterior;
}

double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame) {
  const double measured = yawFromAzimuth(azimuth, h.x.head<3>(), frame.view);
  const double full = wrapAngle(measured - h.x[kYaw]);
  const bool same_head = std::abs(full) <= M_PI / 2;
  const double residual = same_head ? full : wrapAngle(full + M_PI);
  const double variance = sigma * sigma + h.P(kYaw, kYaw);
  const double density =
      std::exp(-0.5 * residual * residual / variance) / std::sqrt(2.0 * M_PI * variance);
  const double uniform = 1.0 / M_PI;
  const double likelihood = (1.0 - kAzimuthOutlier) * density + kAzimuthOutlier * uniform;
  const double inlier = (1.0 - kAzimuthOutlier) * density / likelihood;
  const double head = std::log((1.0 - kAzimuthFlip) / kAzimuthFlip) * weight * inlier;
  h.head = std::clamp(h.head + (same_head ? head : -head), -kMaxHead, kMaxHead);
  const double R = sigma * sigma / std::max(weight * inlier, 1e-9);
  const double S = h.P(kYaw, kYaw) + R;
  const State K = h.P.col(kYaw) / S;
  h.x += K * residual;
  h.P = (h.P - S * K * K.transpose()).eval();
  h.C = (h.C - K * h.C.row(kYaw)).eval();
  if (h.head < 0.0) {
    h.head = -h.head;
    h.x[kYaw] += M_PI;
  }
  h.x[kYaw] = wrapAngle(h.x[kYaw]);
  makeSymmetric(h.P);
  return likelihood;
}

std::optional<std::size_t> update(Object& object, const ObjectLook& look,
                                  const Eigen::VectorXd& eta, const std::vector<Evidence>& boxes,
                                  const FrameContext& frame) {
  if (look.sight.fraction <= 0.0) return std::nullopt;
  std::vector<Shares> shares;
  for (const auto& h : look.hypotheses) shares.push_back(sharesOf(h, eta));
  const double seen = probabilitySeen(object, shares);
  const Worth hit = worthOf(object, look, shares, frame.parameters->looks.correlation);
  const auto own = surelyOwn(object, shares);
  count(object, seen, shares, look);
  const double repeated = repetition(object, frame);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    updateState(object.hypotheses[i], shares[i], look, boxes, repeated, frame);
  }
  const double exponent = seen * hit.worth + 1.0 - seen;
  const LookReasons reasons = reasonsOf(object, shares, seen, hit.worth, exponent, boxes, frame);
  const double mean_A = weigh(object, shares, exponent);
  const double r = object.existence;
  bookExistence(object,
                std::min(r * mean_A / (1.0 - r + r * mean_A), frame.parameters->tend.certain),
                reasons);
  updateAzimuths(object, shares, hit.worth, boxes, frame);
  if (seen >= 0.5) object.hit_view = {frame.view.T_WC(), 1.0 + hit.looks};
  if (sound(object)) bookClasses(object, reasons);
  return own;
}

}  // namespace perdure::semantic_filter

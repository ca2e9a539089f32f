#include "services/semantic_filter/core/update/azimuth_update.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMaxHeading = 6.0;  // nats
constexpr double kOutlier = 0.2;     // share of azimuths that carry no information
constexpr double kFlip = 0.1;        // share of azimuths that are turned by 180°

/// Multiplies the weights of yaw modes by the likelihood of the azimuths. The sum of the weights of
/// each class and motion stays.
void weighYawModes(Track& track, const ScratchVector<double>& likelihood) {
  ScratchMap<std::pair<std::string_view, bool>, std::pair<double, double>> totals;
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    const auto& h = track.hypotheses[i];
    auto& [before, after] = totals[{h.class_name, h.moving}];
    before += h.weight;
    after += h.weight * likelihood[i];
  }
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    auto& h = track.hypotheses[i];
    const auto& [before, after] = totals[{h.class_name, h.moving}];
    if (after > 0.0) h.weight *= likelihood[i] * before / after;
  }
}

}  // namespace

void updateAzimuths(Track& track, const AllShares& shares, double tempering,
                    const ScratchVector<std::size_t>& gated, const std::vector<BoxDetection>& boxes,
                    const FrameContext& frame) {
  const bool any = std::any_of(gated.begin(), gated.end(),
                               [&](std::size_t z) { return boxes[z].azimuth.has_value(); });
  if (!any) return;
  ScratchVector<double> likelihood(track.hypotheses.size(), 1.0);
  for (std::size_t i = 0; i < track.hypotheses.size(); ++i) {
    const ClassPrior& prior = frame.priors->of(track.hypotheses[i].class_name);
    if (!prior.has_yaw) continue;
    for (std::size_t b = 0; b < gated.size(); ++b) {
      const BoxDetection& box = boxes[gated[b]];
      if (!box.azimuth || shares[i].box[b] < 0.2) continue;
      const double sigma = azimuthSigma(box.azimuth_sigma, prior);
      const double weight = shares[i].box[b] * std::sqrt(tempering);
      likelihood[i] *= std::pow(
          updateWithAzimuth(track.hypotheses[i], *box.azimuth, sigma, weight, frame), weight);
    }
  }
  weighYawModes(track, likelihood);
}

double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame) {
  const AzimuthMatch match =
      matchAzimuth(azimuth, h.x, frame.view, sigma * sigma + h.P(kYaw, kYaw));
  h.heading_log_odds =
      std::clamp(h.heading_log_odds + weight * headingOdds(match), -kMaxHeading, kMaxHeading);
  const double R = sigma * sigma / std::max(weight * match.inlier, 1e-9);
  const double S = h.P(kYaw, kYaw) + R;
  const State K = h.P.col(kYaw) / S;
  h.x += K * match.residual;
  h.P = (h.P - S * K * K.transpose()).eval();
  h.C = (h.C - K * h.C.row(kYaw)).eval();
  if (h.heading_log_odds < 0.0) {
    h.heading_log_odds = -h.heading_log_odds;
    h.x[kYaw] += M_PI;
  }
  h.x[kYaw] = wrapAngle(h.x[kYaw]);
  makeSymmetric(h.P);
  return match.likelihood;
}

AzimuthMatch matchAzimuth(double azimuth, const State& x, const View& view, double variance) {
  const double full = wrapAngle(yawFromAzimuth(azimuth, x.head<3>(), view) - x[kYaw]);
  AzimuthMatch match;
  match.same_head = std::abs(full) <= M_PI / 2;
  match.residual = match.same_head ? full : wrapAngle(full + M_PI);
  const double density = std::exp(-0.5 * match.residual * match.residual / variance) /
                         std::sqrt(2.0 * M_PI * variance);
  match.likelihood = (1.0 - kOutlier) * density + kOutlier / M_PI;
  match.inlier = (1.0 - kOutlier) * density / match.likelihood;
  return match;
}

double headingOdds(const AzimuthMatch& match) {
  const double nats = std::log((1.0 - kFlip) / kFlip) * match.inlier;
  return match.same_head ? nats : -nats;
}

double azimuthSigma(double told, const ClassPrior& prior) {
  return std::max(told, prior.azimuth_sigma);
}

}  // namespace perdure::semantic_filter

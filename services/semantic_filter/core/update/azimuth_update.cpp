#include "services/semantic_filter/core/update/azimuth_update.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/azimuth.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kMaxHead = 6.0;  // nats

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

}  // namespace

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

}  // namespace perdure::semantic_filter

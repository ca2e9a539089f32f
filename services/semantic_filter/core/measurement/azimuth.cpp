#include "services/semantic_filter/core/measurement/azimuth.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::semantic_filter {

constexpr double kOutlier = 0.2;  // share of azimuths that carry no information
constexpr double kFlip = 0.1;     // share of azimuths that are turned by 180°

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

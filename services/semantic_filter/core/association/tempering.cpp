#include "services/semantic_filter/core/association/tempering.h"

#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

double correlatedObservations(const Eigen::Vector3d& position, const Viewpoint& last,
                              const View& view, const TemperingParameters& parameters) {
  if (last.observations <= 0.0) return 0.0;
  const double correlation =
      viewCorrelation(position, last.T_WC, view.T_WC(),
                      {parameters.angle, parameters.log_distance, parameters.image_angle});
  return last.observations * correlation;
}

double temperingExponent(double observations, double correlation) {
  const auto information = [&](double n) { return n / (correlation * n + 1.0 - correlation); };
  return information(observations + 1.0) - information(observations);
}

}  // namespace perdure::semantic_filter

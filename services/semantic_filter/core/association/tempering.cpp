#include "services/semantic_filter/core/association/tempering.h"

#include <cmath>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

double sharedLooks(const Eigen::Vector3d& position, const ViewPoint& last, const View& view,
                   const LooksParameters& parameters) {
  if (last.looks <= 0.0) return 0.0;
  const double change =
      viewChange(position, last.T_WC, view.T_WC(),
                 {parameters.angle, parameters.log_distance, parameters.image_angle});
  return last.looks * std::exp(-change);
}

double worthOfLook(double looks, double correlation) {
  const auto information = [&](double n) { return n / (correlation * n + 1.0 - correlation); };
  return information(looks + 1.0) - information(looks);
}

}  // namespace perdure::semantic_filter

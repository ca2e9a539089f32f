// Birth of an object from a box that nobody claims (paper, "Initialization"; DESIGN 5, item 10).
//
// Position, yaw and size minimise the reprojection error of the box under the class's size prior
// (Ceres' TinySolver); the covariance is the inverse of the Gauss-Newton Hessian there, so that a
// depth that only the size prior knows has the uncertainty it deserves. Landmarks inside the box,
// where there are enough, add their weighted centroid. The prior on size is used here and never
// again. The pose error enters position and yaw once, with its cross-covariance.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Range (and its spread) of what is inside a box, from landmarks.
struct RangeHint {
  double distance_m = 0.0, sigma_m = 0.0;
};

/// Centroid along the ray of the landmarks inside the box; weights fall exponentially from its
/// centre. Nothing with fewer than birth.min_landmarks.
std::optional<RangeHint> rangeFromLandmarks(const Evidence& evidence,
                                            const std::vector<SightPoint>& points,
                                            const BirthParameters& parameters);

/// Log of the ratio "new object" to clutter for this box, all classes together.
double logBirthRatio(const Evidence& evidence, const FrameContext& frame);

/// An object without id, or nothing where the box cannot fix one (too few sides measured).
std::optional<Object> bear(const Evidence& evidence, const std::optional<RangeHint>& range,
                           TimePoint now, const FrameContext& frame);

/// One hypothesis for a class and a yaw start. `cost` is half the squared whitened residual.
struct Fit {
  Hypothesis hypothesis;
  double cost = 0.0;
};
std::optional<Fit> fitCuboid(const Evidence& evidence, const ClassPrior& prior, double yaw,
                             double yaw_sigma, const std::optional<RangeHint>& range,
                             const FrameContext& frame);

}  // namespace perdure::semantic_filter

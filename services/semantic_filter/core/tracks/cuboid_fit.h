// Fit of a cuboid to one box, for one class and one start of yaw (paper, "Initialization", line
// 284). Derivation: tools/docs/maths/initiation.md.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

inline constexpr int kFree = kVelocity;  ///< dimensions of the fit: geometry and bias
using VectorFit = Eigen::Matrix<double, kFree, 1>;

/// Range of the object in a box, from landmarks, with its standard deviation.
struct RangeHint {
  double distance_m = 0.0, sigma_m = 0.0;
};

/// Returns the range from the weighted mean of the inverse distances of landmarks inside the box.
/// Weights fall exponentially from its centre and with the relative variance of a landmark. Returns
/// nothing with fewer than `parameters.min_landmarks`.
std::optional<RangeHint> rangeFromLandmarks(const BoxDetection& detection,
                                            const std::vector<LandmarkDepth>& points,
                                            const InitiationParameters& parameters);

/// The hypothesis of one class and one start of yaw. `cost`: half of the squared whitened residual.
struct CuboidFit {
  Hypothesis hypothesis;
  double cost = 0.0;
};
std::optional<CuboidFit> fitCuboid(const BoxDetection& detection, const ClassPrior& prior,
                                   double yaw, double yaw_sigma,
                                   const std::optional<RangeHint>& range,
                                   const FrameContext& frame);

/// Returns the ray in W from the camera through the box's centre, to a depth of 1 m; nothing if the
/// centre cannot be unprojected.
std::optional<Eigen::Vector3d> centreRay(const BoxMeasurement& z, const View& view);

}  // namespace perdure::semantic_filter

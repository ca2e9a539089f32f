// The cuboid that one box, a class and a start of yaw make: the fit of initiation.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

inline constexpr int kFree = kVelocity;  ///< dimensions of the fit: geometry and bias
using VectorFit = Eigen::Matrix<double, kFree, 1>;

/// Range (and its spread) of what is inside a box, from landmarks.
struct RangeHint {
  double distance_m = 0.0, sigma_m = 0.0;
};

/// Centroid along the ray of the landmarks inside the box; weights fall exponentially from its
/// centre. Nothing with fewer than birth.min_landmarks.
std::optional<RangeHint> rangeFromLandmarks(const BoxDetection& detection,
                                            const std::vector<LandmarkDepth>& points,
                                            const InitiationParameters& parameters);

/// One hypothesis for a class and a yaw start. `cost` is half the squared whitened residual.
struct CuboidFit {
  Hypothesis hypothesis;
  double cost = 0.0;
};
std::optional<CuboidFit> fitCuboid(const BoxDetection& detection, const ClassPrior& prior,
                                   double yaw, double yaw_sigma,
                                   const std::optional<RangeHint>& range,
                                   const FrameContext& frame);

/// Unit ray in W through the box's centre.
std::optional<Eigen::Vector3d> centreRay(const BoxMeasurement& z, const View& view);

}  // namespace perdure::semantic_filter

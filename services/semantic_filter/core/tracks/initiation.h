// Birth of an track from a box that nobody claims (paper, "Initialization"; DESIGN 5, item 10).
//
// Position, yaw and size minimise the reprojection error of the box under the class's size prior
// (Ceres' TinySolver); the covariance is the inverse of the Gauss-Newton Hessian there, so that a
// depth that only the size prior knows has the uncertainty it deserves. Landmarks inside the box,
// where there are enough, add their weighted centroid. The prior on size is used here and never
// again. The pose error enters position and yaw once, with its cross-covariance.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/tracks/cuboid_fit.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// Log of the ratio "new object" to clutter for this box, all classes together.
double logInitiationRatio(const BoxDetection& detection, const FrameContext& frame);

/// An track without id, or nothing where the box cannot fix one (too few sides measured).
std::optional<Track> initiate(const BoxDetection& detection, const std::optional<RangeHint>& range,
                              TimePoint now, const FrameContext& frame);

/// Objects from the boxes that nobody claims; `explained` is Association::explained.
void initiateTracks(Belief& belief, const std::vector<TrackVisibility>& visibilities,
                    const Eigen::VectorXd& explained, const FrameInput& input,
                    const FrameContext& frame, IdBook& ids);

}  // namespace perdure::semantic_filter

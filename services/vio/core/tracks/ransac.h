// Outlier rejection of matches between two views whose relative rotation the gyroscope knows: two
// matches then give the direction of translation (Troiani et al., ICRA 2014).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace perdure::vio {

struct Match {
  Eigen::Vector2d before, now;  ///< normalised image points
  double scale = 1.0;           ///< pixels per normalised unit
};

/// Which matches agree with R_now_before and the best translation, to threshold_px from their
/// epipolar lines. Always the same for the same input.
std::vector<bool> twoPointRansac(const std::vector<Match>& matches,
                                 const Eigen::Matrix3d& R_now_before, double threshold_px,
                                 int iterations = 100);

/// Distance in pixels of `now` from the epipolar line of `before` (T: translation direction in the
/// frame of `now`); the distance of the points themselves where there is no line.
double epipolarDistance(const Match& match, const Eigen::Matrix3d& R_now_before,
                        const Eigen::Vector3d& translation);

}  // namespace perdure::vio

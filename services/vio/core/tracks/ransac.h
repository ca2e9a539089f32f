// Outlier rejection of matches between two views whose relative rotation is known from the
// gyroscope. Two matches then give the direction of translation (Troiani et al., ICRA 2014).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace perdure::vio {

struct Match {
  Eigen::Vector2d before, now;  ///< normalised image points
  double scale = 1.0;           ///< pixels per normalised unit
};

/// Returns, for each match, true if it lies within threshold_px of its epipolar line for the best
/// translation. The result is repeatable.
std::vector<bool> twoPointRansac(const std::vector<Match>& matches,
                                 const Eigen::Matrix3d& R_now_before, double threshold_px);

/// Returns the distance in pixels of `now` from the epipolar line of `before`. `translation` is a
/// direction in the frame of `now`. If there is no epipolar line, returns the distance between the
/// points.
double epipolarDistance(const Match& match, const Eigen::Matrix3d& R_now_before,
                        const Eigen::Vector3d& translation);

}  // namespace perdure::vio

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

/// Marks matches within threshold_px of their epipolar lines by the best translation, repeatably.
std::vector<bool> twoPointRansac(const std::vector<Match>& matches,
                                 const Eigen::Matrix3d& R_now_before, double threshold_px);

/// Distance in pixels of `now` from the epipolar line of `before`. translation: direction in the
/// frame of `now`. If no epipolar line exists, the result is the distance between the two points.
double epipolarDistance(const Match& match, const Eigen::Matrix3d& R_now_before,
                        const Eigen::Vector3d& translation);

}  // namespace perdure::vio

// One hypothesis of the mixture: a Gaussian state with its covariance, and its cross-covariance
// with the pose error (one EKF of the paper's eq. 9). Derivation:
// tools/docs/maths/state_and_mixture.md.
#pragma once

#include <Eigen/Core>
#include <string>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/classes/shape.h"

namespace perdure::semantic_filter {

/// x = [p_WO (m), yaw about gravity (rad), log l, log w, log h (log m), b, v_W (m/s)]. The detector
/// bias b is the offset of each detected side (x1, y1, x2, y2) from the image of the cuboid, in
/// widths and heights of the box. b stays while the view stays. v and its covariance are zero in a
/// static hypothesis.
inline constexpr int kStateDim = 14;
using State = Eigen::Matrix<double, kStateDim, 1>;
using StateCovariance = Eigen::Matrix<double, kStateDim, kStateDim>;
using CrossPose = Eigen::Matrix<double, kStateDim, 6>;  ///< with the pose error [θ, p]
inline constexpr int kYaw = 3, kSize = 4, kBias = 7, kVelocity = 11;
inline constexpr int kGeometry = kBias;  ///< dimensions of the cuboid without b and v

/// Height of the ground below an object, from its boxes alone (core/update/ground_contact.h).
struct GroundContact {
  double above = 0.0;     ///< m; height of the ground above the underside of the hypothesis
  double variance = 0.0;  ///< m², given the pose; 0: the boxes give no height
};

struct Hypothesis {
  std::string class_name;
  bool moving = false;
  bool upper_part = false;  ///< x describes the visible part (core/belief/classes/upper_part.h)
  double weight = 0.0;      ///< its probability if the object exists; all sum to 1
  State x = State::Zero();
  StateCovariance P = StateCovariance::Identity();
  CrossPose C = CrossPose::Zero();
  double heading_log_odds = 0.0;  ///< log-odds that the yaw is not turned by 180°
  double speed_prior_ratio =
      1.0;                      ///< moving: ratio of the prior of its speed to the initial Gaussian
  bool modes_searched = false;  ///< a mode search of yaw has weighed it by all keyframes
  GroundContact ground_contact = {};

  double heading() const { return headingOf(heading_log_odds); }
};

}  // namespace perdure::semantic_filter

// One Gaussian of the mixture: state, covariance, and covariance with the pose error.
#pragma once

#include <Eigen/Core>
#include <string>

#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/shape.h"

namespace perdure::semantic_filter {

/// x = [p_WO, yaw about gravity, log l, log w, log h, b, v_W]. b is the detector's own error at
/// this track: how far it puts each side of the box (x1, y1, x2, y2) from the cuboid's image, in
/// widths and heights of the box; it stays while the view stays (DESIGN 5, item 7). v and its
/// covariance are zero while the hypothesis is a static one.
inline constexpr int kStateDim = 14;
using State = Eigen::Matrix<double, kStateDim, 1>;
using StateCovariance = Eigen::Matrix<double, kStateDim, kStateDim>;
using CrossPose = Eigen::Matrix<double, kStateDim, 6>;  ///< P_xg with the pose error [θ, p]
inline constexpr int kYaw = 3, kSize = 4, kBias = 7, kVelocity = 11;
inline constexpr int kGeometry = kBias;  ///< dimensions of the cuboid alone

/// What the looks at a thing alone say of the ground that it stands on (core/ground.h).
struct GroundContact {
  double above = 0.0;     ///< m, beside the underside of the hypothesis
  double variance = 0.0;  ///< m², given the pose; 0: they say nothing
};

struct Hypothesis {
  std::string class_name;
  bool moving = false;
  double weight = 0.0;  ///< of this hypothesis given that the track exists; they sum to 1
  State x = State::Zero();
  StateCovariance P = StateCovariance::Identity();
  CrossPose C = CrossPose::Zero();
  double heading_log_odds = 0.0;  ///< log-odds that the yaw is not turned by 180°
  double speed_prior_ratio =
      1.0;  ///< of a moving one: its speed's prior against the Gaussian it began with
  bool modes_searched = false;  ///< of yaw, and weighed by all looks that are remembered
  GroundContact ground_contact = {};

  /// Shape::corner's, in expectation.
  double heading() const { return headingOf(heading_log_odds); }
};

}  // namespace perdure::semantic_filter

// Predict, lazily (DESIGN 5, items 1, 2 and 11): process noise, motion, survival and the transition
// of the pose error are applied when an object can next be seen; hidden beliefs stay untouched.
#pragma once

#include <optional>

#include "services/semantic_filter/core/measurement/box_likelihood.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// The error of the body's pose at one frame, [θ, p].
struct PoseError {
  Matrix6d covariance = Matrix6d::Zero();
  /// Product of the transitions of all frames so far: an object that was brought up to date at
  /// product A has at product B the cross-covariance C (B A⁻¹)ᵀ.
  Matrix6d product = Matrix6d::Identity();
};

/// The transition of the pose error between two products of transitions. vio's updates make the
/// products small, so that the inverse may lose its sense: then nothing.
std::optional<Matrix6d> transitionBetween(const Matrix6d& earlier, const Matrix6d& later);

/// Whether [P C; Cᵀ P_pose] is a covariance.
bool hangsTogether(const Hypothesis& h, const Matrix6d& P_pose);

/// The hypothesis given that v = 0: what it took for motion was the error of its place.
void stop(Hypothesis& h);
/// When the object gets out of sight: what is more likely slower than `min_speed` may as well
/// stand, and then it stays where it was. Divides such hypotheses by their speed.
void letSlowOnesStand(Object& object, double min_speed);
/// x at a later time: static ones stay, moving ones go on at constant velocity.
State stateAt(const Hypothesis& h, double dt);
/// Where its motion alone will have brought it by `time`, as_of left as it was: for what is said of
/// it between two looks. Not kept, so that the belief itself depends on its looks only.
Object movedOn(Object object, TimePoint time, const MotionParameters& parameters);
/// What changes at an object as the view of it changes, and goes back to where it began.
struct ViewWalk {
  RigidTransform T_WC;  ///< the new view
  double focal = 1.0;   ///< pixels
  SideError lasting;    ///< of b, stationary
  ViewScales bias{1, 1, 1};
  double screened = 0.0;  ///< Object::screened, stationary
  double elusive = 0.0;   ///< Object::elusive, stationary
  ViewScales screen{1, 1, 1};
};
/// Brings the object up to `now`: noise on every hypothesis, P_xg, survival of its existence.
void predict(Object& object, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk);

}  // namespace perdure::semantic_filter

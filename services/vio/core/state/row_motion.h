// Where a camera is while one row of a rolling shutter's image is exposed, seen from the body at
// the middle row (Li, Kim, Mourikis, ICRA 2013; Li & Mourikis, IJRR 2014: the motion within an
// image is the inertial unit's). We differ: it is given in the body's frame and taken as known, so
// that a row's camera is a camera that is mounted elsewhere on the body, and what cannot be
// observed stays so. Derivation: tools/docs/maths/vio-rolling-shutter.md.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"

namespace perdure::vio {

/// The body's motion about an image, in B at its middle row: even accelerations.
struct RowMotion {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< w_WB, rad/s
  Eigen::Vector3d rate_change = Eigen::Vector3d::Zero();   ///< rad/s²
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s², gravity is none

  /// The turn of the body from the middle row until `s` later, as a rotation vector.
  Eigen::Vector3d turn(double s) const { return s * rate + 0.5 * s * s * rate_change; }
};

struct RowCamera {
  RigidTransform T_BC;        ///< B at the middle row, C at this one
  Eigen::Matrix3d R_BR;       ///< R: the body at this row. Turns an error of the mounted p_BC
  Eigen::Vector3d theta_dot;  ///< right tangent of T_BC's rotation by s, rad/s
  Eigen::Vector3d p_dot;      ///< of T_BC's position by s, m/s in B
};

/// The camera that is mounted at T_BC, `s` seconds after the middle row (|s| of some hundredths).
RowCamera rowCamera(const RowMotion& motion, const RigidTransform& T_BC, double s);

}  // namespace perdure::vio

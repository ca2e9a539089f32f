// Pose of a camera while one row of a rolling-shutter image is exposed, relative to the body at the
// middle row (Li, Kim, Mourikis, ICRA 2013; Li & Mourikis, IJRR 2014). Here the IMU's motion within
// an image is in the body's frame and exact. Derivation: tools/docs/maths/vio-rolling-shutter.md.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"
#include "common/math/so3.h"

namespace perdure::vio {

/// Motion of the body during an image, in B at its middle row. The acceleration and the rate's
/// change are constant.
struct RowMotion {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< w_WB, rad/s
  Eigen::Vector3d rate_change = Eigen::Vector3d::Zero();   ///< rad/s²
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s², without gravity

  /// Returns the rotation vector of the body from the middle row to `s` seconds later.
  Eigen::Vector3d turn(double s) const { return s * rate + 0.5 * s * s * rate_change; }
};

struct RowCamera {
  RigidTransform T_BC;        ///< pose of C at this row in B at the middle row
  Eigen::Matrix3d R_BR;       ///< R: body at this row; rotates errors of p_BC into B
  Eigen::Vector3d theta_dot;  ///< derivative of T_BC's rotation (right tangent) by s, rad/s
  Eigen::Vector3d p_dot;      ///< derivative of T_BC's position by s, m/s in B
};

/// Returns the pose of the camera mounted at T_BC, `s` seconds after the middle row. |s| is at most
/// a few hundredths of a second.
inline RowCamera rowCamera(const RowMotion& m, const RigidTransform& T_BC, double s) {
  const Eigen::Vector3d turned = m.turn(s);
  const Eigen::Vector3d rate = rightJacobianSo3(turned) * (m.rate + s * m.rate_change);
  const RigidTransform T_BR(expSo3(turned), s * m.velocity + 0.5 * s * s * m.acceleration);
  RowCamera row;
  row.T_BC = T_BR * T_BC;
  row.R_BR = T_BR.R();
  row.theta_dot = T_BC.q.conjugate() * rate;
  row.p_dot = m.velocity + s * m.acceleration + row.R_BR * rate.cross(T_BC.p);
  return row;
}

}  // namespace perdure::vio

#include "services/vio/core/state/row_motion.h"

#include "common/math/so3.h"

namespace perdure::vio {

using Eigen::Vector3d;

RowCamera rowCamera(const RowMotion& m, const RigidTransform& T_BC, double s) {
  const Vector3d turned = m.turn(s);
  const Vector3d rate = rightJacobianSo3(turned) * (m.rate + s * m.rate_change);
  const RigidTransform T_BR(expSo3(turned), s * m.velocity + 0.5 * s * s * m.acceleration);
  RowCamera row;
  row.T_BC = T_BR * T_BC;
  row.R_BR = T_BR.R();
  row.theta_dot = T_BC.q.conjugate() * rate;
  row.p_dot = m.velocity + s * m.acceleration + row.R_BR * rate.cross(T_BC.p);
  return row;
}

}  // namespace perdure::vio

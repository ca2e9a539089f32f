#include "common/math/rigid_transform.h"

#include "common/math/so3.h"

namespace perdure {

RigidTransform boxPlus(const RigidTransform& T, const Eigen::Matrix<double, 6, 1>& delta) {
  return {T.q * expQuaternion(delta.head<3>()), T.p + delta.tail<3>()};
}

Eigen::Matrix<double, 6, 1> boxMinus(const RigidTransform& a, const RigidTransform& b) {
  Eigen::Matrix<double, 6, 1> delta;
  delta.head<3>() = logSo3(b.q.conjugate() * a.q);
  delta.tail<3>() = a.p - b.p;
  return delta;
}

RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s) {
  return {a.q.slerp(s, b.q), (1.0 - s) * a.p + s * b.p};
}

}  // namespace perdure

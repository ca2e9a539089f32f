// T_AB: maps points of frame B into frame A. Tangent order [θ, p], perturbation on the right for
// the rotation and additive in A for the position: R = R̂ Exp(θ), p = p̂ + δp.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace perdure {

struct RigidTransform {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  ///< Hamilton, unit norm
  Eigen::Vector3d p = Eigen::Vector3d::Zero();            ///< origin of B in A, metres

  RigidTransform() = default;
  RigidTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& position)
      : q(rotation.normalized()), p(position) {}
  RigidTransform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& position)
      : q(Eigen::Quaterniond(rotation).normalized()), p(position) {}

  Eigen::Matrix3d R() const { return q.toRotationMatrix(); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_B) const { return q * point_B + p; }
  RigidTransform operator*(const RigidTransform& T_BC) const {
    return RigidTransform(q * T_BC.q, q * T_BC.p + p);
  }
  RigidTransform inverse() const {
    const Eigen::Quaterniond qi = q.conjugate();
    return RigidTransform(qi, -(qi * p));
  }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = R();
    m.topRightCorner<3, 1>() = p;
    return m;
  }
  bool finite() const { return q.coeffs().allFinite() && p.allFinite(); }
};

/// Returns T ⊞ [θ, δp], in rad and m.
RigidTransform boxPlus(const RigidTransform& T, const Eigen::Matrix<double, 6, 1>& delta);
/// Returns delta = [θ, δp] with b ⊞ delta = a.
Eigen::Matrix<double, 6, 1> boxMinus(const RigidTransform& a, const RigidTransform& b);
/// Interpolates the rotation by slerp and the position linearly; s in [0, 1].
RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s);

}  // namespace perdure

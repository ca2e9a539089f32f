// Rotations: exponential and logarithm of SO(3) and their Jacobians.
// Source: Forster et al., "On-Manifold Preintegration", eq. 3, 4, 8, 9. Perturbation on the right.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace perdure {

/// The matrix [w]x with [w]x v = w × v.
Eigen::Matrix3d skew(const Eigen::Vector3d& w);
/// Rotation by |theta| radians about theta. Any finite theta.
Eigen::Quaterniond expQuaternion(const Eigen::Vector3d& theta);
Eigen::Matrix3d expSo3(const Eigen::Vector3d& theta);
/// The rotation vector with |theta| <= pi.
Eigen::Vector3d logSo3(const Eigen::Quaterniond& q);
Eigen::Vector3d logSo3(const Eigen::Matrix3d& R);
/// J_r with Exp(theta + d) ≈ Exp(theta) Exp(J_r(theta) d).
Eigen::Matrix3d rightJacobianSo3(const Eigen::Vector3d& theta);
/// J_r^-1 with Log(Exp(theta) Exp(d)) ≈ theta + J_r^-1(theta) d; |theta| < 2 pi.
Eigen::Matrix3d rightJacobianInverseSo3(const Eigen::Vector3d& theta);

/// Returns whether R is orthonormal to 1e-2 and right-handed. Not for NaN.
bool isRotation(const Eigen::Matrix3d& R);

/// An angle in radians, wrapped into (-pi, pi].
double wrapAngle(double angle);
/// Yaw about +z of a rotation (x axis projected on the horizontal plane), in (-pi, pi].
double yawOf(const Eigen::Matrix3d& R);
Eigen::Matrix3d rotationAboutZ(double yaw);
/// The smallest rotation that takes the unit vector `up` to +z.
Eigen::Quaterniond levelling(const Eigen::Vector3d& up);

}  // namespace perdure

// Rotations: exponential and logarithm of SO(3) and their Jacobians.
// Source: Forster et al., "On-Manifold Preintegration", eq. 3, 4, 8, 9. Perturbation on the right.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace perdure {

/// Returns the matrix [w]× with [w]× v = w × v.
Eigen::Matrix3d skew(const Eigen::Vector3d& w);
/// Returns the rotation by |theta| radians about theta, for any finite theta.
Eigen::Quaterniond expQuaternion(const Eigen::Vector3d& theta);
Eigen::Matrix3d expSo3(const Eigen::Vector3d& theta);
/// Returns the rotation vector theta, |theta| <= pi.
Eigen::Vector3d logSo3(const Eigen::Quaterniond& q);
Eigen::Vector3d logSo3(const Eigen::Matrix3d& R);
/// Returns J_r with Exp(theta + d) ≈ Exp(theta) Exp(J_r(theta) d).
Eigen::Matrix3d rightJacobianSo3(const Eigen::Vector3d& theta);
/// Returns J_r^-1 with Log(Exp(theta) Exp(d)) ≈ theta + J_r^-1(theta) d, for |theta| < 2 pi.
Eigen::Matrix3d rightJacobianInverseSo3(const Eigen::Vector3d& theta);

/// Returns true if R is orthonormal within 1e-2 and right-handed. R must not contain NaN.
bool isRotation(const Eigen::Matrix3d& R);

/// Returns an angle in radians, wrapped into (-pi, pi].
double wrapAngle(double angle);
/// Returns the yaw of a rotation: the angle about +z of its x axis in the horizontal plane, in
/// (-pi, pi].
double yawOf(const Eigen::Matrix3d& R);
Eigen::Matrix3d rotationAboutZ(double yaw);
/// Returns the smallest rotation that turns `up` (not zero) to +z.
Eigen::Quaterniond levelling(const Eigen::Vector3d& up);

}  // namespace perdure

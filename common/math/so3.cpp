#include "common/math/so3.h"

#include <cmath>

namespace perdure {
namespace {
constexpr double kPi = 3.14159265358979323846;
constexpr double kSmallAngle = 1e-5;
constexpr double kUpsideDown = 1e-12;
}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

Eigen::Quaterniond expQuaternion(const Eigen::Vector3d& theta) {
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  const double s = angle < kSmallAngle ? 0.5 - angle2 / 48.0 : std::sin(0.5 * angle) / angle;
  const double c = angle < kSmallAngle ? 1.0 - angle2 / 8.0 : std::cos(0.5 * angle);
  return Eigen::Quaterniond(c, s * theta.x(), s * theta.y(), s * theta.z()).normalized();
}

Eigen::Matrix3d expSo3(const Eigen::Vector3d& theta) {
  return expQuaternion(theta).toRotationMatrix();
}

Eigen::Vector3d logSo3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double w = sign * q.w();
  const double n = v.norm();
  if (n < kSmallAngle) return v * (2.0 / w) * (1.0 - n * n / (3.0 * w * w));
  return v * (2.0 * std::atan2(n, w) / n);
}

Eigen::Vector3d logSo3(const Eigen::Matrix3d& R) { return logSo3(Eigen::Quaterniond(R)); }

Eigen::Matrix3d rightJacobianSo3(const Eigen::Vector3d& theta) {
  const double a2 = theta.squaredNorm();
  const double a = std::sqrt(a2);
  const Eigen::Matrix3d W = skew(theta);
  const double c1 = a < kSmallAngle ? 0.5 - a2 / 24.0 : (1.0 - std::cos(a)) / a2;
  const double c2 = a < 1e-3 ? 1.0 / 6.0 - a2 / 120.0 : (a - std::sin(a)) / (a2 * a);
  return Eigen::Matrix3d::Identity() - c1 * W + c2 * W * W;
}

Eigen::Matrix3d rightJacobianInverseSo3(const Eigen::Vector3d& theta) {
  const double a2 = theta.squaredNorm();
  const double a = std::sqrt(a2);
  const Eigen::Matrix3d W = skew(theta);
  const double c =
      a < 1e-3 ? 1.0 / 12.0 + a2 / 720.0 : 1.0 / a2 - (1.0 + std::cos(a)) / (2.0 * a * std::sin(a));
  return Eigen::Matrix3d::Identity() + 0.5 * W + c * W * W;
}

bool isRotation(const Eigen::Matrix3d& R) {
  constexpr double kTolerance = 1e-2;
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return error <= kTolerance && !(R.determinant() < 0.0);
}

double wrapAngle(double angle) {
  const double wrapped = std::remainder(angle, 2.0 * kPi);
  return wrapped <= -kPi ? wrapped + 2.0 * kPi : wrapped;
}

double yawOf(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

Eigen::Matrix3d rotationAboutZ(double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Eigen::Quaterniond levelling(const Eigen::Vector3d& up) {
  const Eigen::Vector3d from = up.normalized(), to = Eigen::Vector3d::UnitZ();
  const double cosine = to.dot(from);
  Eigen::Quaterniond q(0.0, 1.0, 0.0, 0.0);  // upside down: any horizontal axis is valid
  if (cosine < -1.0 + kUpsideDown) return q;
  const double s = std::sqrt((1.0 + cosine) * 2.0);
  q.vec() = from.cross(to) * (1.0 / s);
  q.w() = 0.5 * s;
  return q;
}

}  // namespace perdure

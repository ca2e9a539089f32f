#include "common/mapping/places/placed_object.h"

#include <algorithm>

#include "common/mapping/frames/level_errors.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {

double wrapHalfTurn(double angle) { return 0.5 * wrapAngle(2.0 * angle); }

double planeVariance(const PlacedObject& object) {
  return 0.5 * object.covariance.topLeftCorner<2, 2>().trace();
}

PlacedObject laid(const LevelGaussian& T_AB, const PlacedObject& object) {
  PlacedObject o = transformed(T_AB.mean, object);
  const Eigen::Matrix4d J = byFrame(o.p - T_AB.mean.p);
  o.covariance += J * T_AB.covariance * J.transpose();
  return o;
}

void MatchEquations::add(const PlacedObject& seen, const PlacedObject& known, const LevelPose& x,
                         double weight, double blur) {
  const Eigen::Matrix3d R = x.R();
  const Eigen::Vector3d arm = R * seen.p;
  Eigen::Vector4d residual;
  residual << known.p - (x.p + arm), wrapHalfTurn(known.yaw - seen.yaw - x.yaw);
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = R;
  Eigen::Matrix4d S = known.covariance + G * seen.covariance * G.transpose();
  S.diagonal().head<3>().array() += blur * blur;
  const Eigen::Matrix4d W = inverseSymmetric(S);
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -arm.y();
  J(1, 3) = arm.x();
  information += weight * J.transpose() * W * J;
  pull += weight * J.transpose() * W * residual;
  chi2 += weight * residual.dot(W * residual);
  weights += weight;
}

Eigen::Vector4d MatchEquations::step() const { return inverseSymmetric(information) * pull; }

Eigen::Vector4d MatchEquations::stepNear(const Eigen::Matrix4d& prior_information,
                                         const Eigen::Vector4d& to_prior) const {
  const Eigen::Matrix4d weak = 0.1 * prior_information;
  return inverseSymmetric(Eigen::Matrix4d(information + weak)) * (pull + weak * to_prior);
}

Eigen::Matrix4d MatchEquations::covariance() const {
  const double freedom = 4.0 * weights - 4.0;
  const double scale = freedom > 0.0 ? std::max(1.0, chi2 / freedom) : 1.0;
  return scale * inverseSymmetric(information);
}

PlacedObject transformed(const LevelPose& T_AB, PlacedObject object) {
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = T_AB.R();
  object.p = T_AB * object.p;
  object.yaw = wrapAngle(object.yaw + T_AB.yaw);
  object.covariance = (G * object.covariance * G.transpose()).eval();
  return object;
}

}  // namespace perdure::mapping

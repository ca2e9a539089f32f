#include "common/mapping/frames/level_errors.h"

#include <cmath>

namespace perdure::mapping {

Eigen::Matrix4d byFrame(const Eigen::Vector3d& arm_A) {
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -arm_A.y();
  J(1, 3) = arm_A.x();
  return J;
}

Eigen::Matrix4d turnedBy(const Eigen::Matrix3d& R, const Eigen::Matrix4d& covariance) {
  Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
  G.topLeftCorner<3, 3>() = R;
  return G * covariance * G.transpose();
}

double planeSigma(const Eigen::Matrix4d& covariance) {
  return std::sqrt(covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
}

void addFloor(Eigen::Matrix4d& covariance, double floor_m, double floor_rad) {
  covariance.diagonal().head<3>().array() += floor_m * floor_m;
  covariance(3, 3) += floor_rad * floor_rad;
}

}  // namespace perdure::mapping

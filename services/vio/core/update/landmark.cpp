#include "services/vio/core/update/landmark.h"

#include "common/math/so3.h"

namespace perdure::vio {

Eigen::Matrix<double, 3, 6> crossOfRigid(const Eigen::Vector3d& p_W, const RigidTransform& T_WB,
                                         const Matrix6d& pose_covariance) {
  Eigen::Matrix<double, 3, 6> J;
  J << -T_WB.R() * skew(T_WB.inverse() * p_W), Eigen::Matrix3d::Identity();
  return J * pose_covariance;
}

}  // namespace perdure::vio

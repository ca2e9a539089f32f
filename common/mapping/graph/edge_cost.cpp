#include "common/mapping/graph/edge_cost.h"

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr double kFloorMetres = 1e-3;
constexpr double kFloorYaw = 1e-5;

Cholesky<Eigen::Matrix4d> factorOf(Eigen::Matrix4d covariance) {
  covariance.diagonal().head<3>().array() += kFloorMetres * kFloorMetres;
  covariance(3, 3) += kFloorYaw * kFloorYaw;
  const Cholesky factor(covariance);
  if (factor.positive()) return factor;
  return Cholesky<Eigen::Matrix4d>(withLeastEigenvalue(covariance, kFloorYaw * kFloorYaw));
}

}  // namespace

Eigen::Vector4d stateOf(const LevelPose& pose) {
  return {pose.p.x(), pose.p.y(), pose.p.z(), pose.yaw};
}

EdgeCost::EdgeCost(const LevelGaussian& T_ab)
    : T_ab_(T_ab.mean),
      whitening_(factorOf(T_ab.covariance).whiten(Eigen::Matrix4d::Identity().eval())) {}

bool EdgeCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  using Row = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Eigen::Map<const Eigen::Vector4d> a(parameters[0]), b(parameters[1]);
  const Eigen::Matrix3d R_aT = rotationAboutZ(-a[3]);
  const Eigen::Vector3d p_ab = R_aT * (b - a).head<3>();
  Eigen::Vector4d residual;
  residual << p_ab - T_ab_.p, wrapAngle(b[3] - a[3] - T_ab_.yaw);
  Eigen::Map<Eigen::Vector4d>{residuals}.noalias() = whitening_ * residual;
  if (jacobians == nullptr) return true;
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = R_aT;
  if (jacobians[1] != nullptr) Eigen::Map<Row>{jacobians[1]}.noalias() = whitening_ * J;
  J = (-J).eval();
  J(0, 3) = p_ab.y();
  J(1, 3) = -p_ab.x();
  if (jacobians[0] != nullptr) Eigen::Map<Row>{jacobians[0]}.noalias() = whitening_ * J;
  return true;
}

void ScalingLoss::Evaluate(double chi2, double rho[3]) const {
  if (chi2 <= kernel_) {
    rho[0] = chi2, rho[1] = 1.0, rho[2] = 0.0;
    return;
  }
  const double sum = kernel_ + chi2;
  rho[0] = 3.0 * kernel_ - 4.0 * kernel_ * kernel_ / sum;
  rho[1] = weight(chi2);
  rho[2] = -2.0 * rho[1] / sum;
}

double ScalingLoss::weight(double chi2) const {
  if (chi2 <= kernel_) return 1.0;
  const double scale = 2.0 * kernel_ / (kernel_ + chi2);
  return scale * scale;
}

}  // namespace perdure::mapping

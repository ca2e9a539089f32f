#include "services/vio/core/start/epipolar_bias.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::vio {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Smallest eigenvalue of Σ n nᵀ over the epipolar normals n. It is zero for the true R.
double coplanarity(const BearingPair& pair, const Matrix3d& R_C0_C1) {
  Matrix3d M = Matrix3d::Zero();
  for (const auto& [f0, f1] : pair.bearings) {
    const Vector3d n = f0.cross(R_C0_C1 * f1);
    M += n * n.transpose();
  }
  M /= static_cast<double>(pair.bearings.size());
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(M, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

}  // namespace

Vector3d gyroBiasFromPairs(const std::vector<BearingPair>& pairs, const Matrix3d& R_BC) {
  const auto residuals = [&](const Vector3d& bias) {
    Eigen::VectorXd r(static_cast<Eigen::Index>(pairs.size()));
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Matrix3d R_B = pairs[i].R_B0_B1 * expSo3(pairs[i].J_bias * bias);
      r[static_cast<Eigen::Index>(i)] =
          std::sqrt(std::max(coplanarity(pairs[i], R_BC.transpose() * R_B * R_BC), 0.0));
    }
    return r;
  };
  Vector3d bias = Vector3d::Zero();
  double lambda = 1e-3;
  Eigen::VectorXd r = residuals(bias);
  for (int iteration = 0; iteration < 30; ++iteration) {
    Eigen::MatrixXd J(r.size(), 3);
    constexpr double kStep = 1e-4;
    for (int i = 0; i < 3; ++i) {
      J.col(i) = (residuals(bias + kStep * Vector3d::Unit(i)) -
                  residuals(bias - kStep * Vector3d::Unit(i))) /
                 (2.0 * kStep);
    }
    Matrix3d A = J.transpose() * J;
    A.diagonal() *= 1.0 + lambda;
    A.diagonal().array() += 1e-12;
    const Vector3d step = -solveSymmetric(A, J.transpose() * r);
    const Eigen::VectorXd next = residuals(bias + step);
    if (next.squaredNorm() < r.squaredNorm()) {
      bias += step;
      r = next;
      lambda = std::max(0.2 * lambda, 1e-6);
      if (step.norm() < 1e-6) break;
    } else {
      lambda *= 5.0;
      if (lambda > 1e6) break;
    }
  }
  return bias;
}

}  // namespace perdure::vio

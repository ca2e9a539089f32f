// Small tools on Gaussians: density, symmetry, definiteness.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace perdure {

/// log N(residual; 0, S). -infinity when S is not positive definite.
inline double logGaussian(const Eigen::VectorXd& residual, const Eigen::MatrixXd& S) {
  const Eigen::LLT<Eigen::MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const Eigen::VectorXd w = llt.matrixL().solve(residual);
  const double log_det = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  constexpr double kLogTwoPi = 1.8378770664093453;
  return -0.5 * (w.squaredNorm() + log_det + static_cast<double>(residual.size()) * kLogTwoPi);
}

template <class Matrix>
void makeSymmetric(Matrix& P) {
  P = (0.5 * (P + P.transpose())).eval();
}

/// Finite, symmetric within 1e-6 relative, and positive definite.
inline bool isCovariance(const Eigen::MatrixXd& P) {
  if (P.rows() != P.cols() || !P.allFinite()) return false;
  if ((P - P.transpose()).cwiseAbs().maxCoeff() > 1e-6 * (1e-12 + P.cwiseAbs().maxCoeff())) {
    return false;
  }
  return Eigen::LLT<Eigen::MatrixXd>(P).info() == Eigen::Success;
}

}  // namespace perdure

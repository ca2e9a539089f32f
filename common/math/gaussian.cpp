#include "common/math/gaussian.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>

namespace perdure {

double logGaussian(const VectorView& residual, const MatrixView& S) {
  const Cholesky chol(S);
  if (!chol.positive()) return -std::numeric_limits<double>::infinity();
  constexpr double kLogTwoPi = 1.8378770664093453;
  return -0.5 * (chol.whiten(residual).squaredNorm() + chol.logDeterminant() +
                 static_cast<double>(residual.size()) * kLogTwoPi);
}

double squaredMahalanobis(const VectorView& residual, const MatrixView& S) {
  return residual.dot(Eigen::LDLT<Eigen::MatrixXd>(S).solve(residual));
}

Eigen::MatrixXd solveSymmetric(const MatrixView& S, const MatrixView& B) {
  return Eigen::LDLT<Eigen::MatrixXd>(S).solve(B);
}

Eigen::MatrixXd inverseSymmetric(const MatrixView& S) {
  return solveSymmetric(S, Eigen::MatrixXd::Identity(S.rows(), S.cols()));
}

Eigen::MatrixXd regressOn(const MatrixView& S, const MatrixView& B) {
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(S);
  if (!ldlt.isPositive() || ldlt.vectorD().minCoeff() <= 1e-18) {
    return Eigen::MatrixXd::Zero(B.rows(), B.cols());
  }
  return ldlt.solve(B.transpose()).transpose();
}

Eigen::MatrixXd inverse(const MatrixView& A) { return Eigen::MatrixXd(A).inverse(); }

Eigen::Matrix<double, 6, 6> inverse(const Eigen::Matrix<double, 6, 6>& A) { return A.inverse(); }

Eigen::MatrixXd withLeastEigenvalue(const MatrixView& S, double least) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (S + S.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(least).asDiagonal() *
         eigen.eigenvectors().transpose();
}

Eigen::VectorXd eigenvalues(const MatrixView& S) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

bool choleskyInPlace(Eigen::Ref<Eigen::MatrixXd> S) {
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(S).info() == Eigen::Success;
}

void whitenInPlace(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> B) {
  L.triangularView<Eigen::Lower>().solveInPlace(B);
}

}  // namespace perdure

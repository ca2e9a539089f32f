// Small tools on Gaussians: density, symmetry, definiteness; and the decompositions of covariances
// that every estimator needs, compiled once and for any size (Eigen's own, for each fixed size and
// each file anew, cost a third of the build).
#pragma once

#include <Eigen/Core>
#include <utility>

namespace perdure {

using MatrixView = Eigen::Ref<const Eigen::MatrixXd>;
using VectorView = Eigen::Ref<const Eigen::VectorXd>;

/// log N(residual; 0, S). -infinity when S is not positive definite.
double logGaussian(const VectorView& residual, const MatrixView& S);

/// rᵀ S⁻¹ r.
double squaredMahalanobis(const VectorView& residual, const MatrixView& S);

/// S⁻¹ B of a symmetric S, n × n, and an n × m matrix B.
Eigen::MatrixXd solveSymmetric(const MatrixView& S, const MatrixView& B);

/// S⁻¹ of a symmetric S.
Eigen::MatrixXd inverseSymmetric(const MatrixView& S);

/// B S⁻¹ of an m × n matrix B: what B's rows have in common with what S is the covariance of. Zero
/// where S is not positive definite (a pivot below 1e-18).
Eigen::MatrixXd regressOn(const MatrixView& S, const MatrixView& B);

/// A⁻¹ of any square A; not finite where there is none.
Eigen::MatrixXd inverse(const MatrixView& A);

/// The nearest symmetric matrix to S whose eigenvalues are `least` or more.
Eigen::MatrixXd withLeastEigenvalue(const MatrixView& S, double least);

/// Of a symmetric S, in increasing order.
Eigen::VectorXd eigenvalues(const MatrixView& S);

/// Puts L of S = L Lᵀ into S's lower triangle; the upper one is neither read nor written. False
/// where S is not positive definite: S is then void.
bool choleskyInPlace(Eigen::Ref<Eigen::MatrixXd> S);

/// B ← L⁻¹ B with L in the lower triangle of an n × n matrix; B is n × m.
void whitenInPlace(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> B);

/// S = L Lᵀ.
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(Eigen::MatrixXd S);
  bool positive() const { return positive_; }         ///< if not, nothing else may be asked
  Eigen::MatrixXd whiten(const MatrixView& B) const;  ///< L⁻¹ B
  Eigen::VectorXd unwhiten(Eigen::VectorXd w) const;  ///< L⁻ᵀ w
  Eigen::MatrixXd solve(const MatrixView& B) const;   ///< S⁻¹ B
  double logDeterminant() const;                      ///< log |S|
  /// Its storage, for the next one.
  Eigen::MatrixXd release() && { return std::move(L_); }

 private:
  Eigen::MatrixXd L_;
  bool positive_ = false;
};

template <class Matrix>
void makeSymmetric(Matrix& P) {
  P = (0.5 * (P + P.transpose())).eval();
}

/// Finite, symmetric within 1e-6 relative, and positive definite.
bool isCovariance(const MatrixView& P);

}  // namespace perdure

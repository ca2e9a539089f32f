// Functions for Gaussians: density, symmetry, definiteness, and decompositions of covariances. The
// decompositions are compiled once for any size, because instances for each size and file would
// take a third of the build time.
#pragma once

#include <Eigen/Core>
#include <type_traits>
#include <utility>

#include "common/math/dense_kernels.h"

namespace perdure {

using MatrixView = Eigen::Ref<const Eigen::MatrixXd>;
using VectorView = Eigen::Ref<const Eigen::VectorXd>;

/// Returns log N(residual; 0, S), or -infinity if S is not positive definite.
double logGaussian(const VectorView& residual, const MatrixView& S);

/// Returns rᵀ S⁻¹ r for the residual r.
double squaredMahalanobis(const VectorView& residual, const MatrixView& S);

/// Returns S⁻¹ B for a symmetric n × n matrix S and an n × m matrix B.
Eigen::MatrixXd solveSymmetric(const MatrixView& S, const MatrixView& B);

Eigen::MatrixXd inverseSymmetric(const MatrixView& S);

/// Returns B S⁻¹ for an m × n cross-covariance B: the regression on the variable with covariance S.
/// The result is zero if S is not positive definite (a pivot below 1e-18).
Eigen::MatrixXd regressOn(const MatrixView& S, const MatrixView& B);

/// Returns A⁻¹ of a square matrix A. The result is not finite if A is singular.
Eigen::MatrixXd inverse(const MatrixView& A);
Eigen::Matrix<double, 6, 6> inverse(const Eigen::Matrix<double, 6, 6>& A);

/// Returns the symmetric matrix nearest to S whose eigenvalues are at least `least`.
Eigen::MatrixXd withLeastEigenvalue(const MatrixView& S, double least);

/// Returns the eigenvalues of a symmetric S in increasing order.
Eigen::VectorXd eigenvalues(const MatrixView& S);

/// Stores L of S = L Lᵀ in S's lower triangle; the upper one is neither read nor written. Returns
/// false if S is not positive definite; S is then undefined.
bool choleskyInPlace(Eigen::Ref<Eigen::MatrixXd> S);

/// B ← L⁻¹ B with L in the lower triangle of an n × n matrix; B is n × m.
void whitenInPlace(const MatrixView& L, Eigen::Ref<Eigen::MatrixXd> B);

/// The type in which an expression is stored, by columns.
template <class Derived>
using ByColumns =
    Eigen::Matrix<double, Derived::RowsAtCompileTime, Derived::ColsAtCompileTime, Eigen::ColMajor,
                  Derived::MaxRowsAtCompileTime, Derived::MaxColsAtCompileTime>;

/// The factorisation S = L Lᵀ. `Matrix` is the storage type of S; results have the type of the
/// argument. Data of fixed or bounded size therefore need no heap memory.
template <class Matrix>
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(std::type_identity_t<Matrix> S) : L_(std::move(S)) { factorise(); }

  /// The storage of S. Fill it, then call factorise().
  Matrix& matrix() { return L_; }
  void factorise() { positive_ = dense::factorise(L_.data(), L_.rows(), L_.rows()); }

  bool positive() const { return positive_; }  ///< if false, no other function may be called
  template <class Derived>
  ByColumns<Derived> whiten(const Eigen::MatrixBase<Derived>& B) const {
    ByColumns<Derived> W = B;
    dense::whiten(L_.data(), L_.rows(), L_.rows(), W.data(), W.cols());
    return W;
  }
  template <class Derived>
  ByColumns<Derived> unwhiten(const Eigen::MatrixBase<Derived>& B) const {
    ByColumns<Derived> x = B;
    for (Eigen::Index j = L_.rows() - 1; j >= 0; --j) {
      const Eigen::Index below = L_.rows() - 1 - j;
      x.row(j) -= L_.col(j).tail(below).transpose().lazyProduct(x.bottomRows(below));
      x.row(j) /= L_(j, j);
    }
    return x;
  }
  template <class Derived>
  ByColumns<Derived> solve(const Eigen::MatrixBase<Derived>& B) const {
    return unwhiten(whiten(B));
  }
  double logDeterminant() const { return 2.0 * L_.diagonal().array().log().sum(); }  ///< log |S|

 private:
  Matrix L_;
  bool positive_ = false;
};
template <class Derived>
explicit Cholesky(const Eigen::MatrixBase<Derived>&) -> Cholesky<ByColumns<Derived>>;

template <class Matrix>
void makeSymmetric(Matrix& P) {
  P = (0.5 * (P + P.transpose())).eval();
}

/// Returns whether P is finite, symmetric within 1e-6 relative, and positive definite.
template <class Derived>
bool isCovariance(const Eigen::MatrixBase<Derived>& P) {
  if (P.rows() != P.cols() || !P.allFinite()) return false;
  if ((P - P.transpose()).cwiseAbs().maxCoeff() > 1e-6 * (1e-12 + P.cwiseAbs().maxCoeff())) {
    return false;
  }
  return Cholesky(P).positive();
}

}  // namespace perdure

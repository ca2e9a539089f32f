// S = L Lᵀ of the small matrices of fixed size that a filter takes by the thousand: on the stack,
// and without the cost of a call for any size (gaussian.h has those).
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace perdure {

/// Puts L of S = L Lᵀ into S's lower triangle; the upper one is neither read nor written. False
/// where S is not positive definite: S is then void.
template <int N>
bool choleskyInPlace(Eigen::Matrix<double, N, N>& S) {
  for (int j = 0; j < N; ++j) {
    for (int k = 0; k < j; ++k) {
      const double by = S(j, k);
      for (int i = j; i < N; ++i) S(i, j) -= S(i, k) * by;
    }
    if (!(S(j, j) > 0.0)) return false;
    const double pivot = std::sqrt(S(j, j));
    S(j, j) = pivot;
    for (int i = j + 1; i < N; ++i) S(i, j) /= pivot;
  }
  return true;
}

/// B ← B L⁻ᵀ: the rows of B, M × N, whitened.
template <int N, int M>
void whitenRows(const Eigen::Matrix<double, N, N>& L, Eigen::Matrix<double, M, N>& B) {
  for (int j = 0; j < N; ++j) {
    for (int k = 0; k < j; ++k) B.col(j) -= L(j, k) * B.col(k);
    B.col(j) /= L(j, j);
  }
}

/// b ← L⁻¹ b.
template <int N>
void whiten(const Eigen::Matrix<double, N, N>& L, Eigen::Matrix<double, N, 1>& b) {
  for (int i = 0; i < N; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= L(i, k) * b[k];
    b[i] /= L(i, i);
  }
}

}  // namespace perdure

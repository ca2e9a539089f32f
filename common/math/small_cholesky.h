// S = L Lᵀ for small matrices of fixed size, which a filter factorises thousands of times. No heap
// memory is used.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace perdure {

/// Stores L of S = L Lᵀ in S's lower triangle; the upper one is neither read nor written. Returns
/// false if S is not positive definite; S is then undefined.
template <int N>
bool choleskyInPlace(Eigen::Matrix<double, N, N>& S) {
  for (int j = 0; j < N; ++j) {
    double pivot = S(j, j);
    for (int k = 0; k < j; ++k) pivot -= S(j, k) * S(j, k);
    if (!(pivot > 0.0)) return false;
    pivot = std::sqrt(pivot);
    S(j, j) = pivot;
    for (int i = j + 1; i < N; ++i) {
      double sum = S(i, j);
      for (int k = 0; k < j; ++k) sum -= S(i, k) * S(j, k);
      S(i, j) = sum / pivot;
    }
  }
  return true;
}

/// B ← B L⁻ᵀ: whitens the rows of B, M × N.
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

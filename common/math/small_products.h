// Products of matrices of fixed size for the updates of a filter (dense_kernels.h). Sums are in the
// order of the inner dimension, as in Eigen's lazyProduct.
#pragma once

#include <Eigen/Core>

#include "common/math/dense_kernels.h"

namespace perdure {

/// Returns A Bᵀ for A N × K and B M × K.
template <int N, int M, int K>
Eigen::Matrix<double, N, M> timesTransposed(const Eigen::Matrix<double, N, K>& A,
                                            const Eigen::Matrix<double, M, K>& B) {
  Eigen::Matrix<double, N, M> product;
  dense::timesTransposed(A.data(), N, B.data(), M, K, product.data());
  return product;
}

/// Returns A Aᵀ for A N × K, on and below the diagonal; the elements above it are undefined.
template <int N, int K>
Eigen::Matrix<double, N, N> lowerTimesTransposed(const Eigen::Matrix<double, N, K>& A) {
  Eigen::Matrix<double, N, N> product = Eigen::Matrix<double, N, N>::Zero();
  dense::lowerTimesTransposed(A.data(), N, K, product.data());
  return product;
}

/// Returns A' Bᵀ, with A' the first K columns of A, and B M × K.
template <int N, int M, int K>
Eigen::Matrix<double, N, M> leftTimesTransposed(const Eigen::Matrix<double, N, N>& A,
                                                const Eigen::Matrix<double, M, K>& B) {
  Eigen::Matrix<double, N, M> product;
  dense::timesTransposed(A.data(), N, B.data(), M, K, product.data());
  return product;
}

/// Returns A B', with A 4 × K, and B' the first K rows and M columns of B.
template <int M, int K, int N, int P>
Eigen::Matrix<double, 4, M> timesTop(const Eigen::Matrix<double, 4, K>& A,
                                     const Eigen::Matrix<double, N, P>& B) {
  static_assert(K <= N && M <= P);
  Eigen::Matrix<double, 4, M> product;
  dense::fourRowsTimes(A.data(), B.data(), N, K, M, product.data());
  return product;
}

}  // namespace perdure

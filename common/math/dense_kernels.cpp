#include "common/math/dense_kernels.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/math/simd.h"

namespace perdure::dense {
namespace {

using simd::Four, simd::four, simd::Two, simd::two;

constexpr long kFour = 4, kEight = 8;
/// Subtracts the contribution of the columns before j from columns j to j + 4 of rows i to i + 4 N.
/// Below the diagonal block, which is factorised, it also applies the inverse of that block.
template <int N, bool kBelow>
PERDURE_INLINE void reduceTile(double* S, long stride, long i, long j, const Four& inverse) {
  double* column[kFour];
  Four sum[kFour][N];
  for (int c = 0; c < kFour; ++c) {
    column[c] = S + (j + c) * stride;
    for (int r = 0; r < N; ++r) sum[c][r] = four(column[c] + i + kFour * r);
  }
  for (long k = 0; k < j; ++k) {
    const double* known = S + k * stride;
    Four rows[N];
    for (int r = 0; r < N; ++r) rows[r] = four(known + i + kFour * r);
    for (int c = 0; c < kFour; ++c) {
      const double by = known[j + c];
      for (int r = 0; r < N; ++r) sum[c][r] -= rows[r] * by;
    }
  }
  for (int c = 0; c < kFour; ++c) {
    for (int r = 0; r < N; ++r) {
      if (kBelow) {
        for (int k = 0; k < c; ++k) sum[c][r] -= sum[k][r] * column[k][j + c];
        sum[c][r] *= inverse[c];
      }
      four(column[c] + i + kFour * r) = sum[c][r];
    }
  }
}

/// Does the same as reduceTile() below the diagonal block, for one row and `width` columns.
PERDURE_INLINE void reduceRow(double* S, long stride, long i, long j, long width,
                              const Four& inverse) {
  for (long c = 0; c < width; ++c) {
    double sum = S[(j + c) * stride + i];
    for (long k = 0; k < j + c; ++k) sum -= S[k * stride + i] * S[k * stride + j + c];
    S[(j + c) * stride + i] = sum * inverse[c];
  }
}

/// Factorises the diagonal block of `width` columns from j on, and stores the inverses of its
/// diagonal. Returns false if the block is not positive definite.
PERDURE_INLINE bool factoriseBlock(double* S, long stride, long j, long width, Four& inverse) {
  for (long c = j; c < j + width; ++c) {
    double* column = S + c * stride;
    for (long k = j; k < c; ++k) {
      const double by = S[k * stride + c];
      for (long r = c; r < j + width; ++r) column[r] -= by * S[k * stride + r];
    }
    if (!(column[c] > 0.0)) return false;
    column[c] = std::sqrt(column[c]);
    inverse[c - j] = 1.0 / column[c];
    for (long r = c + 1; r < j + width; ++r) column[r] *= inverse[c - j];
  }
  return true;
}

/// Solves rows i to i + N of X, whose rows before i are solved. X has 4 W columns and is stored row
/// by row.
template <int N, int W>
PERDURE_INLINE void whitenRows(const double* L, long stride, long i, double* X) {
  constexpr long kWidth = kFour * W;
  Four sum[N][W];
  for (int r = 0; r < N; ++r) {
    for (int w = 0; w < W; ++w) sum[r][w] = four(X + kWidth * (i + r) + kFour * w);
  }
  for (long k = 0; k < i; ++k) {
    const double* column = L + k * stride + i;
    for (int w = 0; w < W; ++w) {
      const Four x = four(X + kWidth * k + kFour * w);
      for (int r = 0; r < N; ++r) sum[r][w] -= x * column[r];
    }
  }
  for (int r = 0; r < N; ++r) {
    const double inverse = 1.0 / L[(i + r) * stride + i + r];
    for (int w = 0; w < W; ++w) {
      for (int k = 0; k < r; ++k) sum[r][w] -= sum[k][w] * L[(i + k) * stride + i + r];
      sum[r][w] *= inverse;
      four(X + kWidth * (i + r) + kFour * w) = sum[r][w];
    }
  }
}

/// Whitens `columns` columns of B, at most 4 W. `X` is a workspace of n × 4 W numbers.
template <int W>
PERDURE_INLINE void whitenPanel(const double* L, long stride, long n, double* B, long columns,
                                double* X) {
  constexpr long kWidth = kFour * W;
  for (long c = 0; c < kWidth; ++c) {
    for (long i = 0; i < n; ++i) X[kWidth * i + c] = c < columns ? B[n * c + i] : 0.0;
  }
  long i = 0;
  for (; i + kFour <= n; i += kFour) whitenRows<kFour, W>(L, stride, i, X);
  for (; i < n; ++i) whitenRows<1, W>(L, stride, i, X);
  for (long c = 0; c < columns; ++c) {
    for (i = 0; i < n; ++i) B[n * c + i] = X[kWidth * i + c];
  }
}

/// Computes rows from i on of columns j to j + N of A Bᵀ.
template <class V, int kRows, int N>
PERDURE_INLINE void timesTransposedTile(const double* A, long rows, const double* B, long columns,
                                        long inner, long i, long j, double* product) {
  constexpr long kLanes = sizeof(V) / sizeof(double);
  const auto at = [](auto* p) -> auto& {
    if constexpr (sizeof(V) == sizeof(Four)) {
      return four(p);
    } else if constexpr (sizeof(V) == sizeof(Two)) {
      return two(p);
    } else {
      return *p;
    }
  };
  V sum[N][kRows];
  for (int c = 0; c < N; ++c) {
    for (int r = 0; r < kRows; ++r) sum[c][r] = at(A + i + kLanes * r) * B[j + c];
  }
  for (long k = 1; k < inner; ++k) {
    for (int c = 0; c < N; ++c) {
      const double by = B[k * columns + j + c];
      for (int r = 0; r < kRows; ++r) sum[c][r] += at(A + k * rows + i + kLanes * r) * by;
    }
  }
  for (int c = 0; c < N; ++c) {
    for (int r = 0; r < kRows; ++r) at(product + (j + c) * rows + i + kLanes * r) = sum[c][r];
  }
}

/// Computes columns j to j + N of A Bᵀ in all rows from i on.
template <int N>
PERDURE_INLINE void timesTransposedColumns(const double* A, long rows, const double* B,
                                           long columns, long inner, long i, long j,
                                           double* product) {
  for (; i + kEight <= rows; i += kEight) {
    timesTransposedTile<Four, 2, N>(A, rows, B, columns, inner, i, j, product);
  }
  for (; i + kFour <= rows; i += kFour) {
    timesTransposedTile<Four, 1, N>(A, rows, B, columns, inner, i, j, product);
  }
  for (; i + 2 <= rows; i += 2) {
    timesTransposedTile<Two, 1, N>(A, rows, B, columns, inner, i, j, product);
  }
  for (; i < rows; ++i) {
    timesTransposedTile<double, 1, N>(A, rows, B, columns, inner, i, j, product);
  }
}

}  // namespace

PERDURE_ALSO_AVX2 void timesTransposed(const double* A, long rows, const double* B, long columns,
                                       long inner, double* product) {
  long j = 0;
  for (; j + kFour <= columns; j += kFour) {
    timesTransposedColumns<kFour>(A, rows, B, columns, inner, 0, j, product);
  }
  for (; j + 2 <= columns; j += 2) {
    timesTransposedColumns<2>(A, rows, B, columns, inner, 0, j, product);
  }
  for (; j < columns; ++j) timesTransposedColumns<1>(A, rows, B, columns, inner, 0, j, product);
}

PERDURE_ALSO_AVX2 void lowerTimesTransposed(const double* A, long rows, long inner,
                                            double* product) {
  long j = 0;
  for (; j + kFour <= rows; j += kFour) {
    timesTransposedColumns<kFour>(A, rows, A, rows, inner, j, j, product);
  }
  for (; j < rows; ++j) timesTransposedColumns<1>(A, rows, A, rows, inner, j, j, product);
}

PERDURE_ALSO_AVX2 void fourRowsTimes(const double* A, const double* B, long stride, long inner,
                                     long columns, double* product) {
  for (long j = 0; j < columns; ++j) {
    const double* by = B + j * stride;
    Four sum = four(A) * by[0];
    for (long k = 1; k < inner; ++k) sum += four(A + kFour * k) * by[k];
    four(product + kFour * j) = sum;
  }
}

PERDURE_ALSO_AVX2 bool factorise(double* S, long stride, long n) {
  Four inverse = {0.0, 0.0, 0.0, 0.0};
  for (long j = 0; j < n; j += kFour) {
    const long width = std::min(n - j, kFour);
    if (width == kFour) {
      reduceTile<1, false>(S, stride, j, j, inverse);
    } else {
      for (long c = j; c < n; ++c) {
        double* column = S + c * stride;
        for (long k = 0; k < j; ++k) {
          for (long r = c; r < n; ++r) column[r] -= S[k * stride + r] * S[k * stride + c];
        }
      }
    }
    if (!factoriseBlock(S, stride, j, width, inverse)) return false;
    long i = j + width;
    for (; i + kEight <= n; i += kEight) reduceTile<2, true>(S, stride, i, j, inverse);
    for (; i + kFour <= n; i += kFour) reduceTile<1, true>(S, stride, i, j, inverse);
    for (; i < n; ++i) reduceRow(S, stride, i, j, width, inverse);
  }
  return true;
}

PERDURE_ALSO_AVX2 void whiten(const double* L, long stride, long n, double* B, long m) {
  thread_local std::vector<double> panel;
  if (panel.size() < static_cast<std::size_t>(kEight * n)) {
    panel.resize(static_cast<std::size_t>(kEight * n));
  }
  for (long c = 0; c < m; c += kEight) {
    const long columns = std::min(m - c, kEight);
    if (columns > kFour) {
      whitenPanel<2>(L, stride, n, B + n * c, columns, panel.data());
    } else {
      whitenPanel<1>(L, stride, n, B + n * c, columns, panel.data());
    }
  }
}

PERDURE_ALSO_AVX2 void multiplySix(const double* A, const double* B, long n, double* product) {
  constexpr long kInner = 6;
  for (long j = 0; j < n; ++j) {
    const double* by = B + kInner * j;
    for (long i = j - j % kFour; i < n; i += kFour) {
      Four sum = four(A + i) * by[0];
      for (long k = 1; k < kInner; ++k) sum += four(A + k * n + i) * by[k];
      four(product + j * n + i) = sum;
    }
  }
}

}  // namespace perdure::dense

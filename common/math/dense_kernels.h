// Matrix operations that dominate the run time of batch estimates with ten to a hundred dimensions.
// For matrices of this size, Eigen's packing of blocks costs more than the arithmetic. On x86-64
// the functions are also compiled for AVX2, which is used if the machine supports it. Results do
// not depend on the machine, because fused multiply-add is not used.
#pragma once

namespace perdure::dense {

/// Stores L of S = L Lᵀ in the lower triangle of an n × n matrix with column stride `stride`. The
/// elements above the diagonal are undefined afterwards. Returns false if S is not positive
/// definite.
bool factorise(double* S, long stride, long n);

/// B ← L⁻¹ B for an n × m matrix with column stride n.
void whiten(const double* L, long stride, long n, double* B, long m);

/// Computes A B for A n × 6 and B 6 × n, in 4 × 4 blocks on and below the diagonal only; n is a
/// multiple of four.
void multiplySix(const double* A, const double* B, long n, double* product);

/// Computes A Bᵀ for A rows × inner and B columns × inner.
void timesTransposed(const double* A, long rows, const double* B, long columns, long inner,
                     double* product);

/// Computes A Aᵀ for A rows × inner, on and below the diagonal. Elements above it are undefined.
void lowerTimesTransposed(const double* A, long rows, long inner, double* product);

/// Computes A B for A 4 × inner and B inner × columns; the columns of B have the stride `stride`.
void fourRowsTimes(const double* A, const double* B, long stride, long inner, long columns,
                   double* product);

}  // namespace perdure::dense

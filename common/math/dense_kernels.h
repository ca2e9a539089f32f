// The loops in which a batch of some ten to a hundred dimensions spends its time. Eigen's own
// are made for larger matrices: to pack blocks of these costs more than the sums. On x86-64 they
// are compiled for AVX2 as well, taken where the machine has it; without fused multiply-add, so
// that a result does not depend on the machine.
#pragma once

namespace perdure::dense {

/// Puts L of S = L Lᵀ into the lower triangle of an n × n matrix, columns `stride` numbers apart.
/// What is above the diagonal is void then. False where S is not positive definite.
bool factorise(double* S, long stride, long n);

/// B ← L⁻¹ B of an n × m matrix whose columns are n numbers apart.
void whiten(const double* L, long stride, long n, double* B, long m);

/// The 4 × 4 blocks on and below the diagonal of A B, with A n × 6 and B 6 × n; n is a multiple of
/// four.
void multiplySix(const double* A, const double* B, long n, double* product);

/// A Bᵀ with A rows × inner and B columns × inner.
void timesTransposed(const double* A, long rows, const double* B, long columns, long inner,
                     double* product);

/// A Aᵀ with A rows × inner; of what is above the diagonal only some is written.
void lowerTimesTransposed(const double* A, long rows, long inner, double* product);

/// A B with A 4 × inner and B inner × columns, whose columns are `stride` numbers apart.
void fourRowsTimes(const double* A, const double* B, long stride, long inner, long columns,
                   double* product);

}  // namespace perdure::dense

// Vectors of four numbers for the few loops that dominate the run time of a frame. They use GCC's
// vector types; without AVX2 the same operations run in two halves. On x86-64 a function may also
// be compiled for AVX2. Fused multiply-add is not used, so results do not depend on the machine.
#pragma once

#include <algorithm>

// No clones under a sanitizer, because the loader selects a clone before the sanitizer's run time
// starts.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PERDURE_ALSO_AVX2 __attribute__((target_clones("avx2", "default")))
#else
#define PERDURE_ALSO_AVX2
#endif
// The functions called by a clone must be inlined, to be compiled for the same target.
#define PERDURE_INLINE inline __attribute__((always_inline))

namespace perdure::simd {

using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
using Two = double __attribute__((vector_size(16), aligned(8), may_alias));

PERDURE_INLINE Four& four(double* p) { return *reinterpret_cast<Four*>(p); }
PERDURE_INLINE const Four& four(const double* p) { return *reinterpret_cast<const Four*>(p); }
PERDURE_INLINE Two& two(double* p) { return *reinterpret_cast<Two*>(p); }
PERDURE_INLINE const Two& two(const double* p) { return *reinterpret_cast<const Two*>(p); }

PERDURE_INLINE void keepLeast(Four& least, const Four& x) { least = x < least ? x : least; }
PERDURE_INLINE void keepMost(Four& most, const Four& x) { most = x > most ? x : most; }
PERDURE_INLINE double leastOf(const Four& x) {
  return std::min(std::min(x[0], x[1]), std::min(x[2], x[3]));
}
PERDURE_INLINE double mostOf(const Four& x) {
  return std::max(std::max(x[0], x[1]), std::max(x[2], x[3]));
}

}  // namespace perdure::simd

// Counts the heap allocations of the whole process by replacing malloc and operator new. A program
// enables it by linking perdure_allocations; only benchmarks and tests do.
#pragma once

#include <cstdint>

namespace perdure::tests {

/// Calls of malloc, calloc, realloc, aligned allocation and operator new. Frees are not counted.
struct Allocations {
  std::uint64_t own = 0;     ///< allocations by code outside OpenCV's libraries
  std::uint64_t opencv = 0;  ///< allocations by code inside OpenCV's libraries
};

/// Returns the counts since the start of the process, over all threads.
Allocations allocations();

/// Returns the counts since `before`.
Allocations allocationsSince(const Allocations& before);

/// Returns false under a sanitizer, which replaces malloc itself; the counts are then 0.
bool allocationsAreCounted();

}  // namespace perdure::tests

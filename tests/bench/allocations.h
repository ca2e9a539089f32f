// Counts heap allocations of the whole process by standing before malloc and operator new. A
// program gets it by linking perdure_allocations; nothing else of the project does.
#pragma once

#include <cstdint>

namespace perdure::tests {

/// Calls of malloc, calloc, realloc, aligned allocation and operator new; frees are not counted.
struct Allocations {
  std::uint64_t own = 0;     ///< asked for outside of OpenCV's libraries
  std::uint64_t opencv = 0;  ///< asked for by code inside OpenCV's libraries
};

/// Since the process began, in all threads.
Allocations allocations();

/// What was allocated since `before`.
Allocations allocationsSince(const Allocations& before);

/// False under a sanitizer, which owns malloc: then nothing is counted.
bool allocationsAreCounted();

}  // namespace perdure::tests

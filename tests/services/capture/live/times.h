// Durations in nanoseconds, as the kernel counts them.
#pragma once

#include <cstdint>

namespace perdure::capture {

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;

}  // namespace perdure::capture

// Stretches of time as the kernel counts them, in nanoseconds.
#pragma once

#include <cstdint>

namespace perdure::capture {

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;

}  // namespace perdure::capture

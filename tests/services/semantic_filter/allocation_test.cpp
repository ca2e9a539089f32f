// Heap allocations of a running filter: almost none once it has observed a place, however many
// objects it observes.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/bench/allocations.h"
#include "tests/bench/filter_drive.h"

namespace perdure::semantic_filter {
namespace {

/// Median number of allocations per frame, including publishing and fits.
double allocationsOfAFrame(std::size_t in_view) {
  bench::Drive drive(Config{}, in_view, 1);
  constexpr std::uint64_t kWarmUp = 60, kFrames = 60;
  std::vector<std::uint64_t> allocations;
  for (std::uint64_t k = 0; k < kWarmUp + kFrames; ++k) {
    const bench::Sample sample = drive.frame(k);
    if (k >= kWarmUp) allocations.push_back(sample.allocations);
  }
  std::nth_element(allocations.begin(), allocations.begin() + kFrames / 2, allocations.end());
  return static_cast<double>(allocations[kFrames / 2]);
}

TEST(FilterAllocations, AreFewInASteadyState) {
  if (!tests::allocationsAreCounted()) GTEST_SKIP() << "a sanitizer owns malloc";
  EXPECT_LE(allocationsOfAFrame(20), 64.0) << "new tracks and keyframes; 1,694 before";
}

}  // namespace
}  // namespace perdure::semantic_filter

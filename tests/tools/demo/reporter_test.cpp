#include "tools/demo/reporter.h"

#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

Health healthOf(InstanceId instance, std::uint64_t frames) {
  Health health;
  health.instance = instance;
  health.frames_in = health.frames_out = frames;
  health.dropped = frames / 10;
  health.cpu_s = 1.0;
  return health;
}

TEST(ServiceCounts, GoOnAfterARestart) {
  ServiceCounts counts;
  counts.add(healthOf(1, 0));
  counts.add(healthOf(1, 100));
  counts.add(healthOf(2, 0));
  counts.add(healthOf(2, 50));
  EXPECT_EQ(counts.framesIn(), 150u);
  EXPECT_EQ(counts.framesOut(), 150u);
  EXPECT_EQ(counts.dropped(), 15u);
  EXPECT_DOUBLE_EQ(counts.cpuSeconds(), 2.0);
}

TEST(ServiceCounts, CountAFrameOnceWhileTwoProcessesRunDuringASwap) {
  ServiceCounts counts;
  for (std::uint64_t t = 0; t <= 1000; t += 10) {
    if (t <= 700) counts.add(healthOf(1, t));
    if (t >= 300) counts.add(healthOf(2, t - 300));
  }
  EXPECT_EQ(counts.framesIn(), 1000u);
  EXPECT_EQ(counts.framesOut(), 1000u);
  EXPECT_DOUBLE_EQ(counts.cpuSeconds(), 2.0) << "both worked";
}

}  // namespace
}  // namespace perdure::tools

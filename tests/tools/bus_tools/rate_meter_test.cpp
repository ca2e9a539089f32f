#include "tools/bus_tools/rate_meter.h"

#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

TEST(RateMeter, TellsRateAndSpreadOfTheIntervals) {
  RateMeter meter(10.0);
  for (const double t : {0.0, 0.1, 0.2, 0.4}) meter.arrived(t);
  const RateSummary s = meter.summary(0.4);
  EXPECT_EQ(s.messages, 4u);
  EXPECT_NEAR(s.rate_hz, 7.5, 1e-9);
  EXPECT_NEAR(s.shortest_s, 0.1, 1e-9);
  EXPECT_NEAR(s.longest_s, 0.2, 1e-9);
  EXPECT_NEAR(s.deviation_s, 0.0471404520791, 1e-9);
}

TEST(RateMeter, ForgetsWhatIsOlderThanItsWindow) {
  RateMeter meter(1.0);
  meter.arrived(0.0);
  meter.arrived(0.5);
  EXPECT_EQ(meter.summary(1.2).messages, 1u);
  EXPECT_EQ(meter.summary(1.2).rate_hz, 0.0);
  EXPECT_EQ(meter.summary(9.0).messages, 0u);
}

}  // namespace
}  // namespace perdure::tools

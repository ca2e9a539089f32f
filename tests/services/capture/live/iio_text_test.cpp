#include <gtest/gtest.h>

#include "services/capture/live/iio_stream.h"

namespace perdure::capture {
namespace {

TEST(IioText, NamesAClockWhateverEndsTheLine) {
  for (const char* end : {"", "\n", " \n"}) {
    EXPECT_EQ(stampClockNamed(std::string("boottime") + end), StampClock::kBoot);
    EXPECT_EQ(stampClockNamed(std::string("monotonic") + end), StampClock::kMonotonic);
    EXPECT_EQ(stampClockNamed(std::string("monotonic_coarse") + end), StampClock::kMonotonic);
    EXPECT_EQ(stampClockNamed(std::string("realtime") + end), StampClock::kRealtime);
  }
}

TEST(IioText, TakesAClockThatTheHostCannotBeAskedForAsOneElsewhere) {
  for (const char* name : {"monotonic_raw\n", "tai\n", "", "boot time"}) {
    EXPECT_EQ(stampClockNamed(name), StampClock::kElsewhere) << name;
  }
}

TEST(IioText, ReadsAMountMatrixRowByRow) {
  const auto R = parseMount("0, -1, 0; 1, 0, 0; 0, 0, 1\n");
  ASSERT_TRUE(R);
  EXPECT_EQ(*R * Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-2, 1, 3));
  EXPECT_FALSE(parseMount("1, 0, 0"));
  EXPECT_FALSE(parseMount("(null)"));
}

}  // namespace
}  // namespace perdure::capture

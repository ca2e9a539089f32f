#include <gmock/gmock.h>

#include "services/capture/live/imu_pairing.h"

namespace perdure::capture {
namespace {

using ::testing::HasSubstr;

TEST(ImuYield, SaysWhereReadingsDoNotBecomeSamples) {
  ImuYield yield;
  EXPECT_EQ(yield.look(200, 199), "");
  EXPECT_THAT(yield.look(400, 199), HasSubstr("of 200 readings of the IMU 0 became samples"));
  EXPECT_EQ(yield.look(600, 398), "") << "it is of the last second";
}

TEST(ImuYield, SaysNothingOfAnImuThatIsSilent) {
  ImuYield yield;
  EXPECT_EQ(yield.look(0, 0), "");
  EXPECT_EQ(yield.look(9, 0), "");
}

}  // namespace
}  // namespace perdure::capture

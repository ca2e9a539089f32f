#include <gtest/gtest.h>

#include "common/service/health.h"

namespace perdure::service {
namespace {

using std::chrono::milliseconds;

Input::Clock::time_point at(int ms) { return Input::Clock::time_point(milliseconds(ms)); }

TEST(Input, ThatHasNeverComeIsNotSilent) {
  Input input("frames", "fix the camera");
  EXPECT_FALSE(input.silent(at(100'000)));
  input.heardAt(at(0));  // perhaps latched: one message is not a stream
  EXPECT_FALSE(input.silent(at(100'000)));
}

TEST(Input, IsSilentWithinASecondAndSaysForHowLong) {
  Input input("frames", "fix the camera");
  for (int t = 0; t <= 1000; t += 50) input.heardAt(at(t));
  EXPECT_FALSE(input.silent(at(1700)));
  EXPECT_TRUE(input.silent(at(1800)));
  EXPECT_EQ(input.sentence(at(2200)), "no frames for 1.2 s; fix the camera");
  input.heardAt(at(3000));
  EXPECT_FALSE(input.silent(at(3100)));
}

TEST(Input, ThatComesSeldomIsGivenTheTimeOfFourPeriods) {
  Input input("frames", "fix the camera");
  for (int t = 0; t <= 5000; t += 1000) input.heardAt(at(t));
  EXPECT_FALSE(input.silent(at(8900)));
  EXPECT_TRUE(input.silent(at(9100)));
}

}  // namespace
}  // namespace perdure::service

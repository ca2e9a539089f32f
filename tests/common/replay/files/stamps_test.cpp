#include "common/replay/files/stamps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::replay {
namespace {

using testing::HasSubstr;

TEST(Stamps, AreWholeNanosecondsHoweverTheyAreSpelled) {
  const auto expectStamp = [](const char* text, std::int64_t ns) {
    const auto stamp = parseNanoseconds(text);
    ASSERT_TRUE(stamp) << text;
    EXPECT_EQ(toNanoseconds(*stamp), ns) << text;
    EXPECT_EQ(whyNoStamp(text), "");
  };
  expectStamp("1403636579763555584", 1403636579763555584);
  expectStamp(" +5 ", 5);
  expectStamp("1403636579763555584.0", 1403636579763555584);
  expectStamp("1403636579763555584.", 1403636579763555584);
  expectStamp("1.403636579763555584e+18", 1403636579763555584);
  expectStamp("1.000000000010000000e+18", 1000000000010000000);
  expectStamp("1E3", 1000);
  expectStamp("0.0", 0);
}

TEST(Stamps, ThatAreNoNanosecondsSayWhatTheyLookLike) {
  for (const char* text : {"", "x", "-5", "1.5", "1e30", "nan", "0x10", "1.5.2", "1e", "12 13"}) {
    EXPECT_FALSE(parseNanoseconds(text)) << text;
    EXPECT_THAT(whyNoStamp(text), HasSubstr("no stamp")) << text;
  }
  EXPECT_THAT(whyNoStamp("20261130071523123456"), HasSubstr("digits of a date"));
  for (const char* text : {"20261130071523123", "261130071523123", "261130071523123456"}) {
    EXPECT_NE(whyDateDigits(text), "") << text;
  }
  for (const char* text : {"1403636579763555584", "20261330071523123", "1403636579763555", "12"}) {
    EXPECT_EQ(whyDateDigits(text), "") << text;
  }
  EXPECT_THAT(whyNoStamp("1403636579.763555"), HasSubstr("looks like seconds"));
  EXPECT_THAT(whyNoStamp("1403636579763555555;-4"), HasSubstr("decimal commas"));
  EXPECT_THAT(whyNoStamp("1403636579763.5"), HasSubstr("looks like milliseconds"));
  EXPECT_THAT(whyNoStamp("1403636579763555.5"), HasSubstr("looks like microseconds"));
}

}  // namespace
}  // namespace perdure::replay

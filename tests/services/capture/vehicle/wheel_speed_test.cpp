#include "services/capture/vehicle/wheel_speed.h"

#include <gmock/gmock.h>

#include <cmath>

#include "common/base/errors.h"

namespace perdure::capture {
namespace {

using ::testing::HasSubstr;

constexpr const char *kLeft = R"(0x1a0 0|16@1+ (0.01,0) [0|300] "km/h")",
                     *kRight = R"(0x1a0 16|16@1+ (0.01,0) [0|300] "km/h")",
                     *kOther = R"(0x1a1 0|16@1+ (0.01,0) [0|300] "km/h")";

std::vector<std::uint8_t> words(std::uint16_t a, std::uint16_t b = 0) {
  return {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(a >> 8),
          static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(b >> 8)};
}

TEST(WheelSpeed, IsTheMeanOfTheWheelsAndAsUncertainAsTheyDiffer) {
  WheelSpeed wheels(wheelSettings({kLeft, kRight}, "", 0.05));
  const auto even = wheels.frame(0x1a0, false, words(3600, 3600), 1000);
  ASSERT_TRUE(even);
  EXPECT_EQ(even->time_ns, 1000);
  EXPECT_NEAR(even->speed, 10.0, 1e-12);
  const double step = 0.01 / 3.6;
  EXPECT_NEAR(even->sigma, std::sqrt((0.05 * 0.05 + step * step / 12.0) / 2.0), 1e-12);
  const auto apart = wheels.frame(0x1a0, false, words(3600, 7200), 2000);
  ASSERT_TRUE(apart);
  EXPECT_NEAR(apart->speed, 15.0, 1e-12);
  EXPECT_GT(apart->sigma, 5.0) << "one of them slips";
  EXPECT_FALSE(wheels.frame(0x1a1, false, words(3600), 3000)) << "of nobody";
  EXPECT_FALSE(wheels.frame(0x1a0, true, words(3600, 3600), 3000)) << "of 29 bits";
}

TEST(WheelSpeed, WaitsForAllFramesAndGoesOnWithoutOneThatIsSilent) {
  WheelSpeed wheels(wheelSettings({kLeft, kOther}, "", 0.05));
  EXPECT_FALSE(wheels.frame(0x1a0, false, words(3600), 1000));
  const auto both = wheels.frame(0x1a1, false, words(3960), 1400);
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->speed, 10.5, 1e-12);
  EXPECT_EQ(both->time_ns, 1200);
  EXPECT_FALSE(wheels.frame(0x1a0, false, words(3600), 2000));
  const auto alone = wheels.frame(0x1a0, false, words(7200), 3000);
  ASSERT_TRUE(alone) << "the other has said nothing in between";
  EXPECT_NEAR(alone->speed, 10.0, 1e-12);
  EXPECT_EQ(alone->time_ns, 2000);
  EXPECT_EQ(wheels.reasons().of("speed_can_partial"), 1U);
}

TEST(WheelSpeed, SaysWhyAFrameGivesNothing) {
  WheelSpeed wheels(wheelSettings({kLeft}, "", 0.05));
  EXPECT_FALSE(wheels.frame(0x1a0, false, words(0xffff), 1000));
  EXPECT_EQ(wheels.reasons().of("speed_can_invalid"), 1U);
  EXPECT_THAT(wheels.trouble(), HasSubstr("0x1a0"));
  EXPECT_TRUE(wheels.frame(0x1a0, false, words(0), 2000));
  EXPECT_EQ(wheels.trouble(), "");
}

TEST(WheelSpeed, GoesBackwardsWhileTheGearSaysSo) {
  WheelSpeed wheels(wheelSettings({kLeft}, "0x3e9 8|4@1+ (1,0) == 7", 0.05));
  const auto speed = [&] { return wheels.frame(0x1a0, false, words(360), 1000)->speed; };
  EXPECT_NEAR(speed(), 1.0, 1e-12);
  EXPECT_FALSE(wheels.frame(0x3e9, false, words(0x0700), 1500));
  EXPECT_NEAR(speed(), -1.0, 1e-12);
  EXPECT_FALSE(wheels.frame(0x3e9, false, words(0x0600), 1500));
  EXPECT_NEAR(speed(), 1.0, 1e-12);
  EXPECT_EQ(wheels.trouble(), "");
  EXPECT_TRUE(wheels.frame(0x1a0, false, words(360), 4'000'000'000));
  EXPECT_THAT(wheels.trouble(), HasSubstr("0x3e9")) << "it has said nothing for long";
  EXPECT_GE(wheels.reasons().of("speed_can_no_reverse"), 1U);
}

TEST(WheelSpeed, KnowsUnits) {
  for (const auto& [unit, speed] : std::map<std::string, double>{
           {"m/s", 36.0}, {"km/h", 10.0}, {"KM/H", 10.0}, {"mph", 16.09344}, {"kn", 18.52}}) {
    WheelSpeed wheels(wheelSettings({"0x1a0 0|16@1+ (0.01,0) \"" + unit + "\""}, "", 0.05));
    EXPECT_NEAR(wheels.frame(0x1a0, false, words(3600), 1000)->speed, speed, 1e-9) << unit;
  }
}

TEST(WheelSpeed, RefusesAConfigurationWithTheFix) {
  const auto why = [](const std::vector<std::string>& signals, const std::string& reverse = "") {
    try {
      (void)wheelSettings(signals, reverse, 0.05);
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kConfiguration);
      return std::string(error.what());
    }
    return std::string("nothing was wrong");
  };
  EXPECT_THAT(why({}), HasSubstr("needs speed.can.signals"));
  EXPECT_THAT(why({"0x1a0 0|16@1+ (0.01,0)"}), HasSubstr("km/h"));
  EXPECT_THAT(why({"0x1a0 0|16@1+ (0.01,0) \"furlong\""}), HasSubstr("furlong"));
  EXPECT_THAT(why({"hello"}), HasSubstr("speed.can.signals: \"hello\""));
  EXPECT_THAT(why({kLeft}, "0x3e9 8|4@1+ (1,0)"), HasSubstr("== VALUE"));
  for (const char* value : {"R", "7abc", "nan", "", "1e999"}) {
    EXPECT_THAT(why({kLeft}, std::string("0x3e9 8|4@1+ (1,0) == ") + value), HasSubstr("no number"))
        << value;
  }
}

}  // namespace
}  // namespace perdure::capture

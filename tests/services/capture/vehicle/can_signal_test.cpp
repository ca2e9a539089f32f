#include "services/capture/vehicle/can_signal.h"

#include <gmock/gmock.h>

#include <array>
#include <vector>

namespace perdure::capture {
namespace {

using ::testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

CanSignal signal(const std::string& line) {
  auto parsed = parseCanSignal("0x1a0 " + line);
  EXPECT_TRUE(parsed) << line << ": " << parsed.error().detail;
  return parsed.value_or(CanSignal{});
}

std::int64_t raw(const std::string& line, const Bytes& data) {
  return rawValueOf(signal(line), data).value_or(-999999);
}

TEST(CanSignal, ReadsALineOfADbcFileAsItStandsThere) {
  const auto parsed = parseCanSignal(
      R"(416 SG_ WheelSpeed_RL : 23|16@0+ (0.0625,-3.5) [0|400] "km/h" ABS,"Gateway")");
  ASSERT_TRUE(parsed) << parsed.error().detail;
  EXPECT_EQ(parsed->id, 0x1a0U);
  EXPECT_FALSE(parsed->extended);
  EXPECT_EQ(parsed->start, 23U);
  EXPECT_EQ(parsed->length, 16U);
  EXPECT_FALSE(parsed->little_endian);
  EXPECT_FALSE(parsed->is_signed);
  EXPECT_DOUBLE_EQ(parsed->factor, 0.0625);
  EXPECT_DOUBLE_EQ(parsed->offset, -3.5);
  EXPECT_DOUBLE_EQ(parsed->high, 400.0);
  EXPECT_EQ(parsed->unit, "km/h");
}

TEST(CanSignal, KnowsIdsOf29Bits) {
  // J1939's wheel speeds, PGN 65215, in DBC syntax and in hexadecimal.
  for (const char* id : {"2566831870", "0x98febf0b", "0x18febf0b"}) {
    const auto parsed = parseCanSignal(std::string(id) + " 0|16@1+ (1,0)");
    ASSERT_TRUE(parsed) << id;
    EXPECT_TRUE(parsed->extended) << id;
    if (id[1] == 'x') {
      EXPECT_EQ(parsed->id, 0x18febf0bU) << id;
    }
  }
  EXPECT_FALSE(parseCanSignal("0x2000000000 0|8@1+ (1,0)"));
  EXPECT_FALSE(parseCanSignal("0x5fffffff 0|8@1+ (1,0)")) << "30 bits";
}

/// Computed by hand from the numbering of the DBC format: byte · 8 + bit.
TEST(CanSignal, TakesBitsOfBothOrders) {
  EXPECT_EQ(raw("0|16@1+ (1,0)", {0x34, 0x12}), 0x1234);
  EXPECT_EQ(raw("7|16@0+ (1,0)", {0x12, 0x34}), 0x1234);
  EXPECT_EQ(raw("11|12@0+ (1,0)", {0x00, 0x5a, 0xbc}), 0xabc);
  EXPECT_EQ(raw("4|12@1+ (1,0)", {0xc5, 0xab}), 0xabc);
  EXPECT_EQ(raw("13|1@1+ (1,0)", {0x00, 0x20}), 1);
  EXPECT_EQ(raw("13|1@0+ (1,0)", {0xff, 0xdf}), 0);
  EXPECT_EQ(raw("7|64@0- (1,0)", {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfe}), -2);
  EXPECT_EQ(raw("0|64@1- (1,0)", {0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff}), -2);
  EXPECT_EQ(raw("3|4@0- (1,0)", {0x0a}), -6);
  // The signal is beyond the eight bytes of a classic frame.
  Bytes flexible(64);
  flexible[63] = 0x7f;
  EXPECT_EQ(raw("504|8@1+ (1,0)", flexible), 0x7f);
}

TEST(CanSignal, EveryBitOfBothOrdersComesBack) {
  for (const bool little : {true, false}) {
    CanSignal s = signal("0|8@1+ (1,0)");
    s.little_endian = little;
    s.length = 13;
    for (s.start = little ? 0 : 7; s.start < 40; ++s.start) {
      for (unsigned k = 0; k < s.length; ++k) {
        // Position of bit k by the format's numbering: little-endian counts upwards from the start
        // bit, big-endian downwards and then from the top of the next byte.
        unsigned at = s.start;
        for (unsigned step = little ? k : s.length - 1 - k; step > 0; --step) {
          at = little ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
        }
        Bytes data(8);
        data[at / 8] = static_cast<std::uint8_t>(1U << at % 8);
        EXPECT_EQ(rawValueOf(s, data).value(), 1 << k) << little << " " << s.start << " " << k;
      }
    }
  }
}

TEST(CanSignal, RefusesWhatAUnitDoesNotBelieveItself) {
  const auto speed = signal(R"(0|16@1+ (0.01,0) [0|300] "km/h")");
  EXPECT_DOUBLE_EQ(valueOf(speed, Bytes{0x10, 0x27}).value(), 100.0);
  EXPECT_EQ(valueOf(speed, Bytes{0x31, 0x75}).error().code, "speed_can_invalid") << "300.01";
  EXPECT_EQ(valueOf(speed, Bytes{0x10}).error().code, "speed_can_short");
  const auto open = signal("0|16@1+ (0.01,0)");
  EXPECT_EQ(valueOf(open, Bytes{0xff, 0xff}).error().code, "speed_can_invalid");
  EXPECT_DOUBLE_EQ(valueOf(open, Bytes{0xfe, 0xff}).value(), 655.34);
  const auto both_ways = signal("0|16@1- (0.01,0)");
  EXPECT_EQ(valueOf(both_ways, Bytes{0x00, 0x80}).error().code, "speed_can_invalid");
  EXPECT_DOUBLE_EQ(valueOf(both_ways, Bytes{0xff, 0xff}).value(), -0.01);
  EXPECT_DOUBLE_EQ(valueOf(signal("0|1@1+ (1,0)"), Bytes{0x01}).value(), 1.0) << "a flag";
}

TEST(CanSignal, SaysWhatIsWrongInALine) {
  const auto why = [](const char* text) {
    const auto parsed = parseCanSignal(text);
    EXPECT_FALSE(parsed) << text;
    return parsed ? "" : parsed.error().detail;
  };
  EXPECT_THAT(why("0x1a0"), HasSubstr("START|LENGTH"));
  EXPECT_THAT(why("0x1a0 7|16@2+ (1,0)"), HasSubstr("START|LENGTH"));
  EXPECT_THAT(why("0x1a0 0|65@1+ (1,0)"), HasSubstr("64 bits"));
  EXPECT_THAT(why("0x1a0 0|0@1+ (1,0)"), HasSubstr("64 bits"));
  EXPECT_THAT(why("0x1a0 0|8@1+ (0,0)"), HasSubstr("factor"));
  EXPECT_THAT(why("0x1a0 0|8@1+ (-,0)"), HasSubstr("number"));
  EXPECT_THAT(why("0x1a0 0|8@1+ (0.0.1,0)"), HasSubstr("number"));
  EXPECT_THAT(why("0x1a0 0|8@1+ (1,0) [300|0]"), HasSubstr("range"));
  EXPECT_THAT(why("0x1a0 505|8@1+ (1,0)"), HasSubstr("64 bytes"));
  EXPECT_THAT(why("0x1a0 504|9@0+ (1,0)"), HasSubstr("64 bytes"));
  EXPECT_THAT(why("416 SG_ Speed m2 : 0|8@1+ (1,0)"), HasSubstr("multiplexed"));
  EXPECT_THAT(why("0x1a0 0|8@1+ (1e300,0)"), HasSubstr("too large"));
  EXPECT_THAT(why("0x1a0 0|64@1- (-1e12,0)"), HasSubstr("too large")) << "by its bits";
  EXPECT_THAT(why("0x1a0 0|8@1+ (1,-1e300)"), HasSubstr("too large"));
}

// A regular expression uses stack for each character.
TEST(CanSignal, ALineOfAnyLengthIsReadOrRefused) {
  const std::string line = "0x1a0 0|8@1+ (1,0) ";
  EXPECT_TRUE(parseCanSignal(line + std::string(900, 'R')));
  EXPECT_FALSE(parseCanSignal(line + std::string(4'000'000, 'R')));
}

}  // namespace
}  // namespace perdure::capture

#include "common/wire/cdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "common/wire/json.h"
#include "tests/common/wire/all_messages.h"
#include "tests/common/wire/examples.h"

namespace perdure::wire {
namespace {

using testing::HasSubstr;
using testing::Not;

template <class T>
Result<T> decoded(std::vector<std::uint8_t> message) {
  const auto kept = std::make_shared<const std::vector<std::uint8_t>>(std::move(message));
  return decodeCdr<T>(*kept, kept);
}

template <class T>
class Cdr : public testing::Test {};

TYPED_TEST_SUITE(Cdr, AllMessages);

TYPED_TEST(Cdr, BringsEveryFieldThroughBytesAndBack) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    TypeParam message;
    Examples(seed).fill(message);
    const auto bytes = encodeCdr(message);
    ASSERT_TRUE(bytes) << bytes.error().detail;
    const auto back = decoded<TypeParam>(*bytes);
    ASSERT_TRUE(back) << back.error().code << " " << back.error().detail;
    ASSERT_EQ(toJson(*back), toJson(message));
  }
}

TYPED_TEST(Cdr, TakesAnyBytesAndGivesAValueOrAReason) {
  std::mt19937_64 random(11);
  int refused = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    TypeParam message;
    Examples(seed).fill(message);
    auto bytes = *encodeCdr(message);
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n) {
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    if (random() % 2 == 0) bytes.resize(random() % (bytes.size() + 1));
    if (!decoded<TypeParam>(bytes)) ++refused;
  }
  EXPECT_GT(refused, 100);
}

/// The first `size` bytes of a delimited struct, as from an older writer or one that declares a
/// wrong length.
template <class T>
std::vector<std::uint8_t> shortened(std::uint32_t size) {
  T message;
  Examples(1).fill(message);
  auto bytes = *encodeCdr(message);
  constexpr std::size_t kHeads = 8;  // encapsulation and length
  std::memcpy(bytes.data() + 4, &size, sizeof(size));
  bytes.resize(kHeads + size);
  return bytes;
}

// Cyclone 0.10.2 aborts if such a struct is missing.
TEST(CdrLengths, RefusesAMessageThatEndsBeforeAStructThatMayGrow) {
  constexpr std::uint32_t kBeforeBelief = 8 + 32 + 8 + 12;
  for (std::uint32_t size = 0; size <= kBeforeBelief; size += 4) {
    const auto state = decoded<ObjectState>(shortened<ObjectState>(size));
    ASSERT_FALSE(state) << size;
    EXPECT_EQ(state.error().code, "malformed_cdr") << size;
  }
}

// Cyclone swaps eight bytes although it requested four. If the message ends there, it writes beyond
// the end.
TEST(CdrLengths, RefusesACutMessageOfTheOtherByteOrderAndWritesNowhereElse) {
  ImuSample sample;
  Examples(3).fill(sample);
  auto bytes = encodeCdr(sample).value();
  constexpr std::uint8_t kBigEndianXcdr2 = 6;
  bytes[1] = kBigEndianXcdr2;
  for (std::size_t size = bytes.size(); size-- > 4;) {
    bytes.resize(size);
    EXPECT_FALSE(decoded<ImuSample>(bytes)) << size;
  }
}

TEST(CdrLengths, ReadsAMessageThatEndsBeforeMembersThatMayBeAbsent) {
  const auto header = decoded<MapHeader>(shortened<MapHeader>(24));
  ASSERT_TRUE(header) << header.error().detail;
  EXPECT_EQ(header->tiles, 0U);
  const auto calibration = decoded<Calibration>(shortened<Calibration>(8));
  ASSERT_TRUE(calibration) << calibration.error().detail;
  EXPECT_FALSE(calibration->imu);
}

TYPED_TEST(Cdr, RefusesAnEncodingThatItsTypeHasNot) {
  TypeParam message;
  Examples(1).fill(message);
  auto bytes = *encodeCdr(message);
  bytes[1] = 0x03;  // a parameter list
  const auto refused = decoded<TypeParam>(bytes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "bad_encapsulation");
}

TYPED_TEST(Cdr, KnowsTheIdlOfEveryTypeWhole) {
  const std::string name = Type<TypeParam>::descriptor().m_typename;
  const std::string text = idlOf(name);
  EXPECT_THAT(text, HasSubstr("struct " + name.substr(name.rfind(':') + 1) + " {"));
  EXPECT_THAT(text, Not(HasSubstr("#include")));
  if (text.find("FrameStamp stamp;") != std::string::npos) {
    EXPECT_THAT(text, HasSubstr("struct FrameStamp {"));
  }
}

TEST(IdlOf, KnowsNothingOfStrangers) {
  EXPECT_EQ(idlOf("perdure::msg::Object"), "");
  EXPECT_EQ(idlOf("std_msgs::msg::String"), "");
  EXPECT_EQ(idlOf(""), "");
}

}  // namespace
}  // namespace perdure::wire

#include "services/capture/vehicle/can_signal.h"

#include <fmt/format.h>

#include <cmath>
#include <regex>

#include "services/capture/vehicle/whole_number.h"

namespace perdure::capture {
namespace {

constexpr std::uint32_t kExtendedFlag = 0x80000000U, kStandardMask = 0x7ffU,
                        kExtendedMask = 0x1fffffffU;
constexpr unsigned kMostBits = 64 * 8;         // number of bits of a CAN FD frame
constexpr std::size_t kLongestDbcLine = 1000;  // longer lines would need too much stack
constexpr double kLargest = 1e30;              // limit of physical values; its square is finite

/// Returns the position of bit k of a signal, in DBC's numbering byte · 8 + bit. Bit 0 is the
/// lowest.
unsigned positionOf(const CanSignal& s, unsigned k) {
  if (s.little_endian) return s.start + k;
  // The start bit is the highest. Lower bits follow down each byte, then from the top of the next
  // byte.
  const unsigned from_top = s.length - 1 - k;
  const unsigned sequential = s.start / 8 * 8 + (7 - s.start % 8) + from_top;
  return sequential / 8 * 8 + (7 - sequential % 8);
}

Result<CanSignal> withId(CanSignal signal, const std::string& text) {
  const bool hexadecimal = text.size() > 1 && (text[1] == 'x' || text[1] == 'X');
  const unsigned long long id = std::stoull(text, nullptr, hexadecimal ? 16 : 10);
  const bool flagged = (id & kExtendedFlag) != 0 && id <= 0xffffffffULL;
  signal.extended = flagged || id > kStandardMask;
  signal.id = static_cast<std::uint32_t>(id) & (signal.extended ? kExtendedMask : kStandardMask);
  if (!flagged && id > kExtendedMask) return fail("can_signal", "its id has more than 29 bits");
  return signal;
}

}  // namespace

Result<CanSignal> parseCanSignal(const std::string& text) {
  static const std::regex kLine(
      R"re(\s*(0[xX][0-9a-fA-F]{1,8}|\d{1,10})\s+(?:SG_\s+\w+\s*(M|m\d+M?)?\s*:\s*)?)re"
      R"re((\d{1,3})\|(\d{1,3})@([01])([+-])\s*\(\s*([-+.\deE]+)\s*,\s*([-+.\deE]+)\s*\))re"
      R"re(\s*(?:\[\s*([-+.\deE]+)\s*\|\s*([-+.\deE]+)\s*\])?\s*(?:"([^"]*)")?.*)re");
  if (text.size() > kLongestDbcLine) {
    return fail("can_signal", "it is longer than {} characters; leave out its receivers",
                kLongestDbcLine);
  }
  std::smatch m;
  if (!std::regex_match(text, m, kLine)) {
    return fail("can_signal",
                "it is not ID START|LENGTH@ORDER SIGN (FACTOR,OFFSET) [LOW|HIGH] \"UNIT\", as "
                "0x1a0 7|16@0+ (0.01,0) [0|655.35] \"km/h\"");
  }
  if (m[2].length() > 0 && m[2].str() != "M") {
    return fail("can_signal", "it is multiplexed (" + m[2].str() + "), which is not read");
  }
  CanSignal signal;
  const auto numberAt = [&m](std::size_t i) {
    return m[i].length() > 0 ? wholeNumber(m[i].str()) : std::optional(0.0);
  };
  const auto factor = numberAt(7), offset = numberAt(8), low = numberAt(9), high = numberAt(10);
  if (!factor || !offset || !low || !high) return fail("can_signal", "one of its numbers is none");
  signal.start = static_cast<unsigned>(std::stoul(m[3]));
  signal.length = static_cast<unsigned>(std::stoul(m[4]));
  signal.little_endian = m[5] == "1";
  signal.is_signed = m[6] == "-";
  signal.factor = *factor;
  signal.offset = *offset;
  signal.low = *low;
  signal.high = *high;
  if (*low > *high) return fail("can_signal", "its range ends before it begins");
  signal.unit = m[11];
  if (signal.length < 1 || signal.length > 64) return fail("can_signal", "it has not 1 to 64 bits");
  if (signal.factor == 0.0) return fail("can_signal", "its factor is 0");
  if (std::ldexp(std::abs(signal.factor), static_cast<int>(signal.length)) > kLargest ||
      std::abs(signal.offset) > kLargest) {
    return fail("can_signal", "its factor or offset is too large");
  }
  if (signal.start >= kMostBits || positionOf(signal, signal.length - 1) >= kMostBits ||
      positionOf(signal, 0) >= kMostBits) {
    return fail("can_signal", "it ends behind the 64 bytes that a frame can have");
  }
  return withId(signal, m[1]);
}

Result<std::int64_t> rawValueOf(const CanSignal& signal, std::span<const std::uint8_t> data) {
  std::uint64_t raw = 0;
  for (unsigned k = 0; k < signal.length; ++k) {
    const unsigned position = positionOf(signal, k);
    if (position / 8 >= data.size()) {
      return fail("speed_can_short", fmt::format("a frame of CAN id {:#x} has {} bytes, which the "
                                                 "signal goes beyond; look at its place in the DBC",
                                                 signal.id, data.size()));
    }
    raw |= static_cast<std::uint64_t>(data[position / 8] >> (position % 8) & 1U) << k;
  }
  const unsigned unused = 64 - signal.length;
  if (!signal.is_signed) return static_cast<std::int64_t>(raw);
  return static_cast<std::int64_t>(raw << unused) >> unused;
}

Result<double> valueOf(const CanSignal& signal, std::span<const std::uint8_t> data) {
  const auto raw = rawValueOf(signal, data);
  if (!raw) return tl::unexpected(raw.error());
  const std::uint64_t ones = ~std::uint64_t{0} >> (64 - signal.length);
  const auto bits = static_cast<std::uint64_t>(*raw) & ones;
  const std::uint64_t unknown = signal.is_signed ? (ones >> 1) + 1 : ones;
  const double number = signal.is_signed ? static_cast<double>(*raw) : static_cast<double>(bits);
  const double value = number * signal.factor + signal.offset;
  const bool outside = signal.high > signal.low && (value < signal.low || value > signal.high);
  if (outside || (signal.length >= 8 && bits == unknown)) {
    return fail("speed_can_invalid",
                fmt::format("CAN id {:#x} says {:g} {}, which its unit does not believe itself or "
                            "the range of the DBC excludes",
                            signal.id, value, signal.unit));
  }
  return value;
}

}  // namespace perdure::capture

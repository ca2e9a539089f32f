// A number in the frames of a CAN bus, as described by a line of a DBC file.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/result.h"

namespace perdure::capture {

struct CanSignal {
  std::uint32_t id = 0;
  bool extended = false;  ///< 29-bit id
  unsigned start = 0;   ///< DBC's number of the first bit: the lowest (Intel) or highest (Motorola)
  unsigned length = 1;  ///< bits, 1 to 64
  bool little_endian = true, is_signed = false;
  double factor = 1.0, offset = 0.0;  ///< physical = raw · factor + offset
  double low = 0.0, high = 0.0;       ///< range of the physical value; equal: unlimited
  std::string unit;                   ///< unit as written; empty: none
};

/// Parses "ID LINE". ID is decimal as in a DBC file (bit 31 set for 29 bits), or hexadecimal (29
/// bits above 0x7ff). LINE is an SG_ line or its part after the colon: `0x1a0 7|16@0+ (0.01,0)
/// [0|655.35] "km/h"`. Range, unit and receivers are optional. Fails with "can_signal"; the detail
/// is a sentence.
Result<CanSignal> parseCanSignal(const std::string& text);

/// Returns the raw bits, sign extended. Fails with "speed_can_short" if the frame has too few
/// bytes.
Result<std::int64_t> rawValueOf(const CanSignal& signal, std::span<const std::uint8_t> data);

/// Returns the physical value. Fails with "speed_can_short" if the frame has too few bytes, or with
/// "speed_can_invalid" if the value is outside the signal's range or means "not available" (signals
/// of eight bits or more: all ones, or the least signed number).
Result<double> valueOf(const CanSignal& signal, std::span<const std::uint8_t> data);

}  // namespace perdure::capture

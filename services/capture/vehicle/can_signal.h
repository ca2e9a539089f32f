// A number inside the frames of a CAN bus, as a line of a DBC file tells it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/base/result.h"

namespace perdure::capture {

struct CanSignal {
  std::uint32_t id = 0;
  bool extended = false;  ///< an id of 29 bits
  unsigned start = 0;   ///< DBC's number of the first bit: the lowest (Intel) or highest (Motorola)
  unsigned length = 1;  ///< bits, 1 to 64
  bool little_endian = true, is_signed = false;
  double factor = 1.0, offset = 0.0;  ///< physical = raw · factor + offset
  double low = 0.0, high = 0.0;       ///< of the physical value; equal: any
  std::string unit;                   ///< as written; empty: none
};

/// Reads "ID LINE": the id as a DBC file has it (decimal, bit 31 set for 29 bits) or in hexadecimal
/// (29 bits above 0x7ff), and what follows the colon of an SG_ line there, or all of that line:
/// `0x1a0 7|16@0+ (0.01,0) [0|655.35] "km/h"`. Range, unit and receivers may be missing.
/// Reason "can_signal": a sentence that says what is wrong in it.
Result<CanSignal> parseCanSignal(const std::string& text);

/// The raw bits, sign extended. Reason "speed_can_short": the frame has too few bytes.
Result<std::int64_t> rawValueOf(const CanSignal& signal, std::span<const std::uint8_t> data);

/// The physical value. Reasons: "speed_can_short"; "speed_can_invalid": outside of the signal's
/// range, or the pattern by which units say that they know nothing (of eight bits or more: all
/// ones, or the least of a signed number).
Result<double> valueOf(const CanSignal& signal, std::span<const std::uint8_t> data);

}  // namespace perdure::capture

// Encodes bytes as base64 (RFC 4648, with padding), for JSON.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace perdure::gateway {

inline std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = bytes.size() - i;
    const std::uint32_t word = static_cast<std::uint32_t>(bytes[i] << 16U) |
                               (n > 1 ? static_cast<std::uint32_t>(bytes[i + 1] << 8U) : 0U) |
                               (n > 2 ? bytes[i + 2] : 0U);
    text += kDigits[word >> 18U];
    text += kDigits[(word >> 12U) & 63U];
    text += n > 1 ? kDigits[(word >> 6U) & 63U] : '=';
    text += n > 2 ? kDigits[word & 63U] : '=';
  }
  return text;
}

}  // namespace perdure::gateway

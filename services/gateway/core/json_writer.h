// Writes JSON text piece by piece, because building a tree for each frequent message would cost
// more.
#pragma once

#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace perdure::gateway {

/// Encodes bytes in base64 (RFC 4648) with padding.
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

/// Appends JSON and inserts commas. The caller closes objects and arrays, and writes keys before
/// values.
class JsonWriter {
 public:
  explicit JsonWriter(std::size_t expected = 1024) { out_.reserve(expected); }

  JsonWriter& begin(char bracket) {
    comma();
    out_ += bracket;
    return *this;
  }
  JsonWriter& end(char bracket) {
    out_ += bracket;
    return *this;
  }
  JsonWriter& key(std::string_view name) {
    comma();
    out_ += '"';
    out_ += name;
    out_ += "\":";
    return *this;
  }
  /// Writes a number with `decimals` decimals. Writes 0 for numbers that are not finite.
  JsonWriter& number(double value, int decimals = 4) {
    comma();
    char buffer[64];
    constexpr double kLargest = 1e15;
    if (!std::isfinite(value)) value = 0.0;
    const auto format =
        std::abs(value) < kLargest ? std::chars_format::fixed : std::chars_format::scientific;
    const auto done = std::to_chars(buffer, buffer + sizeof buffer, value, format, decimals);
    const char* last = done.ptr;
    if (format == std::chars_format::fixed && decimals > 0) {
      while (last[-1] == '0') --last;
      if (last[-1] == '.') --last;
    }
    out_.append(buffer, static_cast<std::size_t>(last - buffer));
    return *this;
  }
  JsonWriter& integer(std::integral auto value) {
    comma();
    out_ += std::to_string(value);
    return *this;
  }
  JsonWriter& boolean(bool value) {
    comma();
    out_ += value ? "true" : "false";
    return *this;
  }
  JsonWriter& null() {
    comma();
    out_ += "null";
    return *this;
  }
  /// Writes text and escapes it. Bytes that are not UTF-8 become '?'.
  JsonWriter& text(std::string_view value);
  /// Writes a key that may need escaping, because it comes from outside.
  JsonWriter& textKey(std::string_view name) {
    text(name);
    out_ += ':';
    return *this;
  }
  /// Writes a member: a key and a value. The value may be of any type with put(JsonWriter&, value).
  template <class Value, class... Decimals>
  JsonWriter& with(std::string_view name, const Value& value, Decimals... decimals) {
    key(name);
    if constexpr (std::same_as<Value, bool>) {
      boolean(value);
    } else if constexpr (std::integral<Value>) {
      integer(value);
    } else if constexpr (std::floating_point<Value>) {
      number(value, decimals...);
    } else if constexpr (std::convertible_to<const Value&, std::string_view>) {
      text(value);
    } else if constexpr (std::convertible_to<const Value&, std::span<const double>>) {
      list(value, decimals...);
    } else {
      put(*this, value);
    }
    return *this;
  }
  JsonWriter& with(std::string_view name, std::span<const double> values, int decimals = 4) {
    return key(name).list(values, decimals);
  }
  JsonWriter& list(std::span<const double> values, int decimals = 4) {
    begin('[');
    for (const double value : values) number(value, decimals);
    return end(']');
  }
  /// Writes text that is already JSON.
  JsonWriter& raw(std::string_view json) {
    comma();
    out_ += json;
    return *this;
  }

  const std::string& str() const { return out_; }
  std::string take() { return std::move(out_); }

 private:
  void comma() {
    if (out_.empty()) return;
    const char last = out_.back();
    if (last != '{' && last != '[' && last != ':') out_ += ',';
  }
  std::string out_;
};

}  // namespace perdure::gateway

#include "services/gateway/core/json_writer.h"

#include <algorithm>

namespace perdure::gateway {
namespace {

/// Length in bytes of the first UTF-8 character; 0 if invalid.
std::size_t characterAt(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 0;
  if (length == 0 || first > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  const bool overlong = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xf0 && byte(1) < 0x90);
  const bool beyond = (first == 0xed && byte(1) > 0x9f) || (first == 0xf4 && byte(1) > 0x8f);
  return overlong || beyond ? 0 : length;
}

}  // namespace

JsonWriter& JsonWriter::text(std::string_view value) {
  constexpr char kHex[] = "0123456789abcdef";
  comma();
  out_ += '"';
  while (!value.empty()) {
    const std::size_t length = characterAt(value);
    const auto c = static_cast<unsigned char>(value.front());
    if (length == 0) {
      out_ += '?';
    } else if (c == '"' || c == '\\') {
      out_ += '\\';
      out_ += static_cast<char>(c);
    } else if (c < 0x20 || c == 0x7f) {
      out_ += "\\u00";
      out_ += kHex[c >> 4U];
      out_ += kHex[c & 0xfU];
    } else {
      out_ += value.substr(0, length);
    }
    value.remove_prefix(std::max<std::size_t>(1, length));
  }
  out_ += '"';
  return *this;
}

}  // namespace perdure::gateway

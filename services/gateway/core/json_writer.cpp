#include "services/gateway/core/json_writer.h"

#include <algorithm>

#include "common/base/algorithms/utf8.h"

namespace perdure::gateway {
JsonWriter& JsonWriter::text(std::string_view value) {
  constexpr char kHex[] = "0123456789abcdef";
  comma();
  out_ += '"';
  while (!value.empty()) {
    const std::size_t length = lengthOfCharacter(value);
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

#include "common/replay/phone/gpmf.h"

#include <bit>

namespace perdure::replay::phone {
namespace {

template <class Unsigned>
Unsigned bigEndian(std::string_view bytes) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
    value = static_cast<Unsigned>(value << 8U | static_cast<unsigned char>(bytes[i]));
  }
  return value;
}

template <class Number, class Unsigned>
double numberAt(std::string_view bytes) {
  return static_cast<double>(std::bit_cast<Number>(bigEndian<Unsigned>(bytes)));
}

struct NumberType {
  std::size_t size = 0;
  double (*read)(std::string_view bytes) = nullptr;
};

NumberType numberType(char type) {
  switch (type) {
    case 'b':
      return {1, numberAt<std::int8_t, std::uint8_t>};
    case 'B':
      return {1, numberAt<std::uint8_t, std::uint8_t>};
    case 's':
      return {2, numberAt<std::int16_t, std::uint16_t>};
    case 'S':
      return {2, numberAt<std::uint16_t, std::uint16_t>};
    case 'l':
      return {4, numberAt<std::int32_t, std::uint32_t>};
    case 'L':
      return {4, numberAt<std::uint32_t, std::uint32_t>};
    case 'j':
      return {8, numberAt<std::int64_t, std::uint64_t>};
    case 'J':
      return {8, numberAt<std::uint64_t, std::uint64_t>};
    case 'f':
      return {4, numberAt<float, std::uint32_t>};
    case 'd':
      return {8, numberAt<double, std::uint64_t>};
    default:
      return {};
  }
}

}  // namespace

Result<std::vector<GpmfItem>> itemsOf(std::string_view text) {
  constexpr std::size_t kHead = 8, kAlignment = 4;
  std::vector<GpmfItem> items;
  while (text.size() >= kHead) {
    GpmfItem item{std::string(text.substr(0, 4)),
                  text[4],
                  bigEndian<std::uint8_t>(text.substr(5)),
                  bigEndian<std::uint16_t>(text.substr(6)),
                  {}};
    text.remove_prefix(kHead);
    const std::size_t bytes = item.size * item.count;
    if (bytes > text.size()) return fail("gpmf_damaged", "{} is cut off", item.key);
    item.data = text.substr(0, bytes);
    text.remove_prefix(std::min(text.size(), (bytes + kAlignment - 1) / kAlignment * kAlignment));
    items.push_back(std::move(item));
  }
  return items;
}

std::vector<double> numbersOf(const GpmfItem& item) {
  const NumberType type = numberType(item.type);
  std::vector<double> numbers;
  if (type.size == 0) return numbers;
  for (std::size_t at = 0; at + type.size <= item.data.size(); at += type.size) {
    numbers.push_back(type.read(item.data.substr(at, type.size)));
  }
  return numbers;
}

}  // namespace perdure::replay::phone

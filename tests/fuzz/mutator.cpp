#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace perdure::fuzz {
namespace {

using namespace std::string_view_literals;

constexpr std::array kNumbers{
    "nan"sv,   "inf"sv,   "-1"sv,         "0"sv,       "1e400"sv,
    "1e300"sv, "-1e18"sv, "1e-320"sv,     "0x10"sv,    "9223372036854775807"sv,
    "2"sv,     "-0"sv,    "4294967296"sv, "1000000"sv, "-9223372036854775808"sv,
    "1."sv,    ""sv,      "+3"sv,         "1 2"sv,     "99999999999999999999"sv,
};
constexpr std::array kWords{
    "\n"sv,
    ","sv,
    "\""sv,
    "["sv,
    "]"sv,
    "{"sv,
    "}"sv,
    ": "sv,
    "#"sv,
    "\r\n"sv,
    "\0"sv,
    "=== "sv,
    "\xff\xff\xff\xff"sv,
    "\xff\xff\xff\x7f"sv,
    "\0\0\0\x80"sv,
    "\xc3\x28"sv,
    "\xf0\x9f\x9a\x97"sv,
    "&a *a"sv,
    "null"sv,
    "~"sv,
    "true"sv,
    "\t"sv,
    "- "sv,
    "? "sv,
    "!!binary "sv,
    "\0\0\0\0"sv,
};

bool isOfNumber(std::uint8_t c) { return (c >= '0' && c <= '9') || c == '.' || c == '-'; }

void replace(Bytes& bytes, std::size_t at, std::size_t length, std::string_view with) {
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(length));
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), with.begin(), with.end());
}

}  // namespace

/// Replaces a number of the text.
void Mutator::putNumber(Bytes& bytes) {
  const std::size_t from = below(bytes.size());
  const auto begin =
      std::find_if(bytes.begin() + static_cast<std::ptrdiff_t>(from), bytes.end(), isOfNumber);
  const auto end = std::find_if_not(begin, bytes.end(), isOfNumber);
  replace(bytes, static_cast<std::size_t>(begin - bytes.begin()),
          static_cast<std::size_t>(end - begin), kNumbers[below(kNumbers.size())]);
}

void Mutator::putWord(Bytes& bytes) {
  const std::string_view word = kWords[below(kWords.size())];
  const std::size_t at = below(bytes.size() + 1);
  const std::size_t over = below(2) == 0 ? 0 : std::min(word.size(), bytes.size() - at);
  replace(bytes, at, over, word);
}

/// Moves or copies a line, or the bytes up to a newline, to another place.
void Mutator::moveLine(Bytes& bytes, bool copy) {
  const auto lineAt = [&](std::size_t at) {
    const auto end = std::find(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), '\n');
    return std::min(static_cast<std::size_t>(end - bytes.begin()) + 1, bytes.size());
  };
  const std::size_t from = lineAt(below(bytes.size())), to = lineAt(std::min(from, bytes.size()));
  const std::string line(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                         bytes.begin() + static_cast<std::ptrdiff_t>(to));
  if (!copy) replace(bytes, from, to - from, "");
  replace(bytes, lineAt(below(bytes.size())), 0, line);
}

void Mutator::change(Bytes& bytes, const Bytes& other) {
  const std::size_t at = below(bytes.size()),
                    length = below(std::min<std::size_t>(bytes.size() - at + 1, 64));
  switch (below(9)) {
    case 0:
      if (!bytes.empty()) bytes[at] ^= static_cast<std::uint8_t>(1U << below(8));
      return;
    case 1:
      if (!bytes.empty()) bytes[at] = static_cast<std::uint8_t>(random_());
      return;
    case 2:
      return replace(bytes, at, length, "");
    case 3:
      return bytes.resize(at);
    case 4: {
      const std::size_t from = below(other.size());
      const std::string part(other.begin() + static_cast<std::ptrdiff_t>(from), other.end());
      return replace(bytes, at, length, part.substr(0, below(128)));
    }
    case 5:
      return moveLine(bytes, below(2) == 0);
    case 6:
      return putWord(bytes);
    default:
      return putNumber(bytes);
  }
}

Bytes Mutator::damaged(const Bytes& seed, const Bytes& other) {
  Bytes bytes = seed;
  for (std::size_t n = 1 + below(4); n > 0; --n) change(bytes, other);
  return bytes;
}

}  // namespace perdure::fuzz

// Checks against programming errors: conditions that must hold, checked in every build type.
#pragma once

#include <array>
#include <cstddef>
#include <source_location>
#include <string_view>

namespace perdure {

/// Prints "file:line: function: must hold: <what>" to stderr and aborts.
[[noreturn]] void failCheck(std::string_view what, const std::source_location& where);

/// If `condition` is false, calls failCheck(), which prints `what` and the source location and
/// aborts. Do not use it for external input.
inline void check(bool condition, std::string_view what,
                  const std::source_location& where = std::source_location::current()) {
  if (!condition) [[unlikely]]
    failCheck(what, where);
}

/// Returns the name of an enumerator. The enumerators must have the values 0 to N − 1.
template <std::size_t N>
const char* nameAt(const std::array<const char*, N>& names, auto enumerator) {
  const auto position = static_cast<std::size_t>(enumerator);
  check(position < N, "an enumerator is one of those declared");
  return names[position];
}

}  // namespace perdure

// Parses numbers in configurations and in lines from sockets. The whole text must be one number.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace perdure::capture {

/// Returns the finite number in the text, which may have blanks around it. Returns nothing for
/// other texts.
inline std::optional<double> wholeNumber(std::string_view text) {
  const auto first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first + (text[first] == '+' ? 1 : 0), last - first + 1);
  if (text.back() == ' ') text.remove_suffix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace perdure::capture

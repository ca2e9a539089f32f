// Values as text, shared by reading (error messages) and printing. Internal to common/config.
#pragma once

#include <string>

#include "common/config/fields.h"

namespace perdure::config {

/// "a, b, c".
std::string choicesText(const Field& field);
/// The shortest decimal number that reads back to the same double.
std::string numberText(double value);
/// "> 0", "≥ 1", "0 … 5", or empty for any value. The unit is appended if there is one.
std::string rangeText(const Range& range, const std::string& unit);
/// A double-quoted YAML scalar.
std::string quoted(const std::string& text);

}  // namespace perdure::config

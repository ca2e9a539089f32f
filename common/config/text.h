// Values as text, shared by reading (error messages) and printing. Internal to common/config.
#pragma once

#include <string>

#include "common/config/fields.h"

namespace perdure::config {

/// The allowed values of a field: "a, b, c".
std::string choicesText(const Field& field);
/// The shortest decimal number that reads back to the same double.
std::string numberText(double value);
/// A range followed by its unit, if any: "> 0 m", "≥ 1", "0 … 5". Returns "" if any value is
/// allowed.
std::string rangeText(const Range& range, const std::string& unit);
/// The text as a double-quoted YAML scalar.
std::string quoted(const std::string& text);

}  // namespace perdure::config

// The ledger as JSON, with numbers that are equal on every machine.
#pragma once

#include <nlohmann/json.hpp>

#include "common/types/ledger.h"

namespace perdure {

/// Rounds to ten significant digits, because results of different compilers differ in the last
/// bits.
double rounded(double value);

/// Returns the kinds of evidence that were observed; null for an empty ledger. Kinds without a name
/// are called "kind_N".
nlohmann::ordered_json toJson(const Ledger& ledger);

}  // namespace perdure

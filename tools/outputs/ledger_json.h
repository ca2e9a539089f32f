// The ledger of an object as JSON, with the names of the kinds of evidence; and numbers that are
// equal on every machine.
#pragma once

#include <nlohmann/json.hpp>

#include "common/types/ledger.h"

namespace perdure::tools {

/// Rounds to ten significant digits. This is better than a micrometre over a town, and hides the
/// last bits, in which compilers may differ.
double rounded(double value);

/// Contains only the observed kinds; null for an empty ledger. Unknown kinds are named "kind_N".
nlohmann::ordered_json toJson(const Ledger& ledger);

}  // namespace perdure::tools

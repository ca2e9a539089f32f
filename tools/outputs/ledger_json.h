// The ledger as JSON, with numbers that are equal on every machine.
#pragma once

#include <nlohmann/json.hpp>

#include "common/types/ledger.h"

namespace perdure::tools {

/// Ten significant digits hide the last bits, in which compilers differ.
double rounded(double value);

/// Contains only the observed kinds; null for an empty ledger. Unknown kinds are named "kind_N".
nlohmann::ordered_json toJson(const Ledger& ledger);

}  // namespace perdure::tools

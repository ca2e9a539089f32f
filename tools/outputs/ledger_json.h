// Why an object is believed, as JSON by the names of the kinds of evidence; and as numbers that
// read the same on every machine.
#pragma once

#include <nlohmann/json.hpp>

#include "common/types/ledger.h"

namespace perdure::tools {

/// Ten significant digits read back to better than a micrometre over a town, and hide the last bits
/// in which two compilers may differ.
double rounded(double value);

/// Only kinds that were met; null for an empty ledger. Kinds that this program does not know are
/// "kind_N".
nlohmann::ordered_json toJson(const Ledger& ledger);

}  // namespace perdure::tools

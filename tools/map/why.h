// Explains in plain text why the map contains an object.
#pragma once

#include <string>

#include "common/types/objects.h"

namespace perdure::tools {

/// Lists the entries of existence and class with their sums. Reports a missing ledger, and a sum
/// that differs from the current estimate.
std::string toWhy(const ObjectBelief& object);

}  // namespace perdure::tools

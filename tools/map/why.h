// Explains in plain text why the map contains an object.
#pragma once

#include <string>

#include "common/types/objects.h"

namespace perdure::tools {

/// Entries of existence and class with their sums, and whether these differ from the estimate.
std::string toWhy(const ObjectBelief& object);

}  // namespace perdure::tools

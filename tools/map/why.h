// Explains in plain text why the map contains an object.
#pragma once

#include <string>

#include "common/types/objects.h"

namespace perdure::tools {

/// Returns the entries of existence and class with their sums, and a note if a sum differs from the
/// estimate.
std::string toWhy(const ObjectBelief& object);

}  // namespace perdure::tools

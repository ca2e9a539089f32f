// Why the map believes in an object, told as a person would.
#pragma once

#include <string>

#include "common/types/objects.h"

namespace perdure::tools {

/// What existence and class are made of, entry by entry, with their sums. Says so where there is no
/// ledger, and where one does not add up to what is believed.
std::string toWhy(const ObjectBelief& object);

}  // namespace perdure::tools

// Messages as JSON for people and tools; the field names are those of this file's neighbours,
// describe.h. Times are nanoseconds, matrices lists of rows, pixels only counted.
#pragma once

#include <nlohmann/json.hpp>

#include "common/wire/description/types.h"

namespace perdure::wire {

template <class T>
nlohmann::ordered_json toJson(const T& value);

}  // namespace perdure::wire

// Messages as JSON for users and tools. Field names are those of common/types. Times are in
// nanoseconds, matrices are lists of rows, and pixels are only counted.
#pragma once

#include <nlohmann/json.hpp>

#include "common/wire/topics.h"

namespace perdure::wire {

template <class T>
nlohmann::ordered_json toJson(const T& value);

}  // namespace perdure::wire

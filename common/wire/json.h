// Messages as JSON: names of common/types, times in ns, pixels are only counted.
#pragma once

#include <nlohmann/json.hpp>

#include "common/wire/topics.h"

namespace perdure::wire {

template <class T>
nlohmann::ordered_json toJson(const T& value);

}  // namespace perdure::wire

// Finds the camera that an id of the configuration names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace perdure::capture {

/// Index of the id equal to `wanted`, else of the first that contains it. With `alone`, only one
/// may contain it. Fails with "camera_absent".
Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone);

}  // namespace perdure::capture

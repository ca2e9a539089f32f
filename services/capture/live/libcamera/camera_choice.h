// Finds the camera that an id of the configuration names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace perdure::capture {

/// Index in `ids` of the id equal to `wanted`, otherwise of the first id that contains it. With
/// `alone`, only one id may contain it, so that left and right are not exchanged. Fails with
/// "camera_absent" and the fix.
Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone);

}  // namespace perdure::capture

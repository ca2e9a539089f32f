// Which of the cameras that are there an id of the configuration names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace perdure::capture {

/// The place in `ids` of the one that is `wanted`, else of the first with it in its id. With
/// `alone` no other may have it: left and right must not change places. "camera_absent" with the
/// mend.
Result<std::size_t> chooseCamera(const std::vector<std::string>& ids, const std::string& wanted,
                                 bool alone);

}  // namespace perdure::capture

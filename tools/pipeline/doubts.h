// What a run that ended well has counted, and a person must be told all the same: sentences with
// the mend.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "tools/calibrate/rig_check.h"

namespace perdure::tools {

/// vio: reasons of vio, or of what makes points where poses are given; frames: of the first camera;
/// without_pose: of those, where poses are given.
std::vector<std::string> doubtsOfRun(const ReasonCounts& vio, std::uint64_t frames,
                                     std::uint64_t without_pose);

/// What vio came to believe of the rig that the rig cannot be. `check`: of the run.
std::vector<std::string> doubtsOfRig(const calibrate::RigCheck& check);

}  // namespace perdure::tools

// Problems of a run that ended normally, for the user: sentences with the fix.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "tools/calibrate/rig_check.h"

namespace perdure::tools {

/// vio: reasons of vio, or, with given poses, of the node that computes landmarks. frames: of the
/// first camera; without_pose: those of them without a given pose.
std::vector<std::string> doubtsOfRun(const ReasonCounts& vio, std::uint64_t frames,
                                     std::uint64_t without_pose);

/// Estimates of vio that the rig cannot have. `check`: the check of the run.
std::vector<std::string> doubtsOfRig(const calibrate::RigCheck& check);

}  // namespace perdure::tools

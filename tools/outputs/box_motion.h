// Checks whether the boxes of objects at rest move in the images as the camera's poses predict. The
// boxes of one object in successive frames must be views of one point. The residuals of the best
// point are compared with those after each change of coordinates or frame numbers that corresponds
// to a common error of detection files.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/types/sensors.h"
#include "tools/outputs/pictures/drive_log.h"
#include "tools/outputs/run_doubts.h"

namespace perdure::tools {

/// Returns the error after whose correction the boxes agree much better with the poses. Returns
/// nothing if they agree as they are, or if the motion does not distinguish the errors: a straight
/// drive looks the same in a mirror.
std::optional<Doubt> doubtOfBoxes(const std::map<std::uint64_t, FrameGlance>& frames,
                                  const CameraCalibration& calibration);

}  // namespace perdure::tools

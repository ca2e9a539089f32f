// Motion of the body between two times of a recording, measured by IMU, speed sensor or camera.
#pragma once

#include "common/replay/dataset.h"

namespace perdure::tools {

/// RMS of the gyroscope's rotation in steps of 0.3 s, without its mean, rad.
double turningIn(const replay::Recording& recording, TimePoint from, TimePoint to);
/// Median absolute speed in m/s.
double speedIn(const replay::Recording& recording, TimePoint from, TimePoint to);
/// Median flow in px between two images; 0 if they cannot be compared.
double flowOf(const replay::Recording& recording, const replay::Recording::FrameFile& a,
              const replay::Recording::FrameFile& b);
/// Median flow in px of three image pairs of cam0; about 0 for a camera at rest.
double flowIn(const replay::Recording& recording, TimePoint from, TimePoint to);

}  // namespace perdure::tools

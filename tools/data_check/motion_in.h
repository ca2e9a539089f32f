// Motion of the body between two times of a recording, by each of its sensors.
#pragma once

#include "common/replay/dataset.h"

namespace perdure::tools {

/// RMS of the gyroscope's rotation in steps of 0.3 s, without its mean, rad.
double turningIn(const replay::Recording& recording, TimePoint from, TimePoint to);
/// Median speed, m/s.
double speedIn(const replay::Recording& recording, TimePoint from, TimePoint to);
/// Median flow in px between two images; 0 if they cannot be compared.
double flowOf(const replay::Recording& recording, const replay::Recording::FrameFile& a,
              const replay::Recording::FrameFile& b);
/// Median flow in px of image pairs of cam0 at three places; the background of a camera at rest has
/// none.
double flowIn(const replay::Recording& recording, TimePoint from, TimePoint to);

}  // namespace perdure::tools

// Focal length, rotation and time offset from rotations alone: for each length and offset the
// rotation follows in closed form (Wahba, Kabsch).
#pragma once

#include "tools/calibrate/motion/track_windows.h"

namespace perdure::calibrate {

struct FirstGuess {
  CameraCalibration camera;  ///< focal length, T_BC's rotation, time offset
  double unexplained = 1.0;  ///< share of the image rotation that the gyroscope does not explain
  double turning_px = 0.0;   ///< RMS rotation between two images
  double second_px = 0.0;    ///< about the second most rotated axis
  std::size_t pairs = 0;
};

/// `camera`: size and name. Focal lengths of 0.4 to 2.5 widths, offsets up to half a second.
FirstGuess guessFromTurns(const std::vector<TrackWindow>& windows,
                          const std::vector<ImuSample>& samples, const CameraCalibration& camera);

}  // namespace perdure::calibrate

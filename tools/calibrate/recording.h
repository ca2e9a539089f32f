// Reads what is to be calibrated: a drive in front of a board, or a folder of pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/calibrate/estimate/views.h"

namespace perdure::calibrate {

/// What one camera saw.
struct CameraViews {
  CameraCalibration
      prior;               ///< as the drive (or the rig file) says; of pictures: name and size only
  std::size_t images = 0;  ///< looked at
  std::vector<View> views;  ///< with the board in them
};

struct CalibrationDrive {
  std::vector<CameraViews> cameras;
  std::vector<ImuSample> samples;
  std::optional<ImuCalibration> imu;
  std::string problem;  ///< the last thing that could not be read
};

struct ReadOptions {
  std::filesystem::path data, rig;  ///< rig: goes before the drive's own calibration
  std::string sequence;
  std::size_t every = 1;  ///< each N-th image
};

/// Throws StartupError(kUnavailable) with the mend: nothing to read, or no board in any image.
CalibrationDrive readDrive(const Board& board, const ReadOptions& options,
                           const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace perdure::calibrate

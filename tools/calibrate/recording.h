// Reads the data of a calibration: a drive in front of a board, or a folder of pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/calibrate/estimate/board.h"

namespace perdure::calibrate {

struct CameraViews {
  CameraCalibration
      prior;               ///< source: the drive or the rig file; for pictures, name and size only.
  std::size_t images = 0;  ///< images searched
  std::vector<View> views;  ///< views with the board
};

struct CalibrationDrive {
  std::vector<CameraViews> cameras;
  std::vector<ImuSample> samples;
  std::optional<ImuCalibration> imu;
  std::string problem;  ///< error of the last read; empty: no error
};

struct ReadOptions {
  std::filesystem::path data, rig;  ///< rig: overrides the drive's own calibration
  std::string sequence;
  std::size_t every = 1;  ///< uses each N-th image
};

/// Throws StartupError(kUnavailable) with the fix if there are no images, or no image shows a
/// board.
CalibrationDrive readDrive(const Board& board, const ReadOptions& options,
                           const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace perdure::calibrate

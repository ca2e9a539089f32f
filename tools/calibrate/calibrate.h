// Implements `perdure calibrate`: estimates a rig from a recording, with a report and pictures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/calibrate/verdict.h"

namespace perdure::calibrate {

struct CalibrateOptions {
  Board board;
  /// Default: the model of the drive's own calibration, or radial-tangential if it has none.
  std::optional<DistortionModel> lens;
  bool intrinsics_only = false;
  CameraImuOptions place;
};

struct CalibratedCamera {
  CameraViews seen;
  Intrinsics lens;
  std::optional<CameraImu> place;
  Judgements judgements;
  /// The last estimate of the lens, with the camera's pose on the IMU if it was estimated.
  CameraCalibration result() const;
};

struct Calibrated {
  Board board;
  std::vector<CalibratedCamera> cameras;
  Calibration rig;
  Judgements all() const;
};

/// Throws StartupError(kUnavailable) with the reason and the fix if the data do not suffice.
Calibrated calibrate(const CalibrationDrive& drive, const CalibrateOptions& options);

/// Writes rig.yaml, calibration.json and residuals_<camera>.png.
void writeCalibrated(const Calibrated& calibrated, const std::filesystem::path& folder);
std::string reportText(const Calibrated& calibrated);

/// Draws the residuals over the image and over time, and the IMU's residuals if it was used.
void drawResiduals(const CalibratedCamera& camera, const std::filesystem::path& file);

}  // namespace perdure::calibrate

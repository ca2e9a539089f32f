// `perdure calibrate` as a function: from what was read to a rig, its report and its pictures.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/calibrate/verdict.h"

namespace perdure::calibrate {

struct CalibrateOptions {
  Board board;
  /// Not given: as the drive's own calibration says; radial-tangential where it says nothing.
  std::optional<DistortionModel> lens;
  bool intrinsics_only = false;
  CameraImuOptions place;
};

struct CalibratedCamera {
  CameraViews seen;
  Intrinsics lens;
  std::optional<CameraImu> place;
  Judgements judgements;
  /// The lens as it was estimated last, and the place where there is one.
  CameraCalibration result() const;
};

struct Calibrated {
  Board board;
  std::vector<CalibratedCamera> cameras;
  Calibration rig;
  Judgements all() const;
};

/// Throws StartupError(kUnavailable) with the reason and its mend.
Calibrated calibrate(const CalibrationDrive& drive, const CalibrateOptions& options);

/// rig.yaml, calibration.json, residuals_<camera>.png.
void writeCalibrated(const Calibrated& calibrated, const std::filesystem::path& folder);
std::string reportText(const Calibrated& calibrated);

/// The residuals over the image and over time, and those of the IMU.
void drawResiduals(const CalibratedCamera& camera, const std::filesystem::path& file);

}  // namespace perdure::calibrate

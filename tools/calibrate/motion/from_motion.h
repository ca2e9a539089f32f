// Estimates the rig of a camera and an IMU from the motion of any recording, without a board: first
// from rotations alone, then jointly with the structure that parallax shows (joint.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/replay/data_check.h"
#include "tools/calibrate/motion/joint.h"
#include "tools/calibrate/motion/track_windows.h"

namespace perdure::calibrate {

struct FirstGuess {
  CameraCalibration camera;  ///< focal length, T_BC's rotation, time offset
  double unexplained = 1.0;  ///< share of the image rotation that the gyroscope does not explain
  double turning_px = 0.0;   ///< RMS rotation between two images
  double second_px = 0.0;    ///< about the second most rotated axis
  std::size_t pairs = 0;
};

/// Uses size and name of `camera`. Tests focal lengths of 0.4 to 2.5 widths and time offsets up to
/// half a second.
FirstGuess guessFromTurns(const std::vector<TrackWindow>& windows,
                          const std::vector<ImuSample>& samples, const CameraCalibration& camera);

struct MotionRig {
  Calibration rig;  ///< cam0 and the IMU's noise
  JointEstimate joint;
  JointVector prior_sigma;
  std::size_t images = 0;
  double second_px = 0.0;  ///< RMS rotation about the second axis between two images
};

/// Estimates all parameters; the only prior knowledge is the image size. Fails with
/// motion_few_images, motion_blank, motion_apart (images and gyroscope do not rotate together),
/// motion_no_rotation or motion_unsure, with a detail for users.
Result<MotionRig> rigFromMotion(const replay::Recording& recording, const WindowOptions& options);

/// One line per parameter: value, standard deviation, and whether the motion determines it.
std::vector<std::string> linesOf(const MotionRig& found);

/// Writes the rig file of a drive. Throws StartupError(kData) with the reason if no rig can be
/// estimated.
MotionRig writeMotionRig(const replay::DatasetOptions& drive, const WindowOptions& options,
                         const std::filesystem::path& file);

struct MotionCheck {
  replay::DataFindings findings;  ///< codes: focal_length, time_offset, readout, rig_changes
  /// The motion that the comparison is based on, or why no comparison is possible.
  std::string basis;
};
/// Uses a few short runs of images. Assumes that the rest of the calibration is nearly right.
MotionCheck checkMotion(const replay::Recording& recording);

}  // namespace perdure::calibrate

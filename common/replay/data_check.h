// Checks of a recording before a run: consistency of stamps, units, images and calibration. Each
// finding states the error, its place, and the fix.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/replay/dataset.h"

namespace perdure::replay {

struct DataFinding {
  /// kNote: has no effect on results. kCause: later checks and vio would only show its consequences.
  enum class Grade { kNote, kWarning, kCause, kFatal };
  Grade grade = Grade::kWarning;
  std::string code;  ///< short, stable, snake_case
  std::string text;  ///< a sentence, with the fix
};
using DataFindings = std::vector<DataFinding>;

/// The sensors that a run uses. Only their data are checked.
struct DataUse {
  bool images = true, imu = true;
};

/// The text of the finding images_upside_down begins with these words.
inline constexpr char kUpsideDown[] = "images upside down";

/// Checks some images of each camera, the sizes of all files, and all stamps and samples. Codes:
/// image_unreadable, images_unreadable, images_empty, image_size, image_flat, accel_in_g,
/// accel_in_mg, accel_in_mm, accel_scale, accel_without_gravity, imu_columns_exchanged, gyro_scale,
/// imu_repeats, imu_saturated, imu_axis_stuck, imu_spike, images_upside_down, lines_lost, and those
/// of checkClocks().
DataFindings checkData(const Recording& recording, const DataUse& use);

/// Checks units and axes of the inertial samples only.
DataFindings checkImuUnits(const std::vector<ImuSample>& samples);

/// Returns a frame's image in grey, reduced by the factor `reduce` (1, 2, 4 or 8). 16-bit images
/// are scaled by their used bits. The reasons are those that Dataset counts for images.
Result<cv::Mat> monoImageOf(const Recording::FrameFile& frame, int reduce = 1);

/// Returns the largest factor for monoImageOf that leaves `columns` columns and half as many rows.
int reductionFor(const CameraCalibration& camera, std::uint32_t columns);
/// Returns whether an image that was reduced by `factor` agrees with the calibrated size. Smaller
/// differences than `factor` pixels cannot be recognised.
bool isOfCamera(const cv::Mat& reduced, int factor, const CameraCalibration& camera);

/// Throws StartupError(kData) with all fatal findings; does nothing if there are none. The message
/// begins with `where`.
void refuseFatal(const DataFindings& findings, const std::string& where);

}  // namespace perdure::replay

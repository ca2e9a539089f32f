// Checks of a recording before a run: consistency of stamps, units, images and calibration. Each
// finding states the error, its place, and the fix.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/replay/dataset.h"

namespace perdure::replay {

struct DataFinding {
  enum class Grade { kWarning, kFatal };
  Grade grade = Grade::kWarning;
  std::string code;  ///< short, stable, snake_case
  std::string text;  ///< a sentence, with the fix
};
using DataFindings = std::vector<DataFinding>;

/// The use of the data: only the parts that are used are checked.
struct DataUse {
  bool images = true, imu = true;
};

/// Contained in the text of images_upside_down.
inline constexpr char kUpsideDown[] = "images upside down";

/// Checks some images of each camera, the sizes of all files, and all stamps and samples. Codes:
/// image_unreadable, images_unreadable, images_empty, image_size, image_flat, stamps_equal,
/// stamps_count, stamps_unit, clocks_apart, declared_rates, imu_covers_part, imu_rate, accel_in_g,
/// accel_in_mg, accel_in_mm, accel_scale, accel_without_gravity, imu_columns_exchanged, gyro_scale,
/// images_upside_down.
DataFindings checkData(const Recording& recording, const DataUse& use);

/// Checks the inertial samples only.
DataFindings checkImuUnits(const std::vector<ImuSample>& samples);

/// The image of a frame in grey; 16-bit images are scaled by their used bits. Reasons as counted by
/// Dataset.
/// `reduce`: 1, 2, 4 or 8, the factor by which it is smaller.
Result<cv::Mat> monoImageOf(const Recording::FrameFile& frame, int reduce = 1);

/// The largest factor for monoImageOf that leaves this many columns, and half as many rows.
int reductionFor(const CameraCalibration& camera, std::uint32_t columns);
/// Whether a reduced image has the size of the camera's images, as far as it can be known.
bool isOfCamera(const cv::Mat& reduced, int factor, const CameraCalibration& camera);

/// Throws StartupError(kData) with all fatal findings; does nothing if there are none. The message
/// begins with `where`.
void refuseFatal(const DataFindings& findings, const std::string& where);

}  // namespace perdure::replay

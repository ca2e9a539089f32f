// What a program can know of a recording before it starts: whether stamps, units, images and
// calibration fit together. Each finding says what was found, where, and the mend.
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
  std::string text;  ///< a sentence, with the mend
};
using DataFindings = std::vector<DataFinding>;

/// What is to be done with the data: only what is used is looked at.
struct DataUse {
  bool images = true, imu = true;
};

/// In the text of images_upside_down.
inline constexpr char kUpsideDown[] = "images upside down";

/// Looks at some images of each camera, at the sizes of all files, and at all stamps and samples.
/// Codes: image_unreadable, images_unreadable, images_empty, image_size, image_flat, stamps_equal,
/// stamps_count, stamps_unit, clocks_apart, imu_covers_part, imu_rate, accel_in_g, accel_in_mg,
/// accel_in_mm, accel_scale, accel_without_gravity, imu_columns_exchanged, gyro_scale,
/// images_upside_down.
DataFindings checkData(const Recording& recording, const DataUse& use);

/// Of the inertial samples alone.
DataFindings checkImuUnits(const std::vector<ImuSample>& samples);

/// The frame's image, grey; of 16 bits by what it uses. Reasons as Dataset counts them.
Result<cv::Mat> monoImageOf(const Recording::FrameFile& frame);

/// Throws StartupError(kData) with all that is fatal; nothing where nothing is. `where` begins it.
void refuseFatal(const DataFindings& findings, const std::string& where);

}  // namespace perdure::replay

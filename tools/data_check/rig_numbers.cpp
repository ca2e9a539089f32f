#include "tools/data_check/rig_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::DataFindings;
using Grade = DataFinding::Grade;

std::string intrinsicsText(const CameraCalibration& camera) {
  return fmt::format(
      "the intrinsics of {} (fx {:.4g}, fy {:.4g}, cx {:.4g}, cy {:.4g}, images of "
      "{}x{})",
      camera.name, camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height);
}

/// Whether a principal point is near the middle, in shares of the image.
bool isCentral(double x, double y) {
  constexpr double kFar = 0.35;
  return std::abs(x - 0.5) < kFar && std::abs(y - 0.5) < kFar;
}

void checkIntrinsics(const CameraCalibration& camera, DataFindings& findings) {
  constexpr double kLeastFocal = 0.1;  // of the width: a fisheye over 180 degrees has 0.3
  constexpr double kApart = 1.5;       // of fx and fy
  if (camera.width == 0 || camera.height == 0) return;
  const double width = camera.width, height = camera.height;
  if (std::min(camera.fx, camera.fy) < kLeastFocal * width) {
    const bool shares = camera.cx < 2.0 && camera.cy < 2.0;
    findings.push_back(
        {Grade::kFatal, "intrinsics_unit",
         intrinsicsText(camera) + " are not in pixels: " +
             (shares ? "they are shares of the image; multiply fx and cx by the width, fy and cy "
                       "by the height"
                     : "focal lengths in millimetres? Multiply them by the image's width and "
                       "divide by the sensor's, or calibrate")});
    return;
  }
  if (isCentral(camera.cx / width, camera.cy / height)) {
    const double ratio = std::max(camera.fx, camera.fy) / std::min(camera.fx, camera.fy);
    if (ratio < kApart) return;
    findings.push_back({Grade::kWarning, "intrinsics_order",
                        intrinsicsText(camera) + " have focal lengths far apart: see their order, "
                                                 "fx, fy, cx, cy"});
    return;
  }
  const bool exchanged = isCentral(camera.fx / width, camera.fy / height);
  findings.push_back(
      {Grade::kWarning, "intrinsics_order",
       intrinsicsText(camera) + " have the principal point far from the middle: see " +
           (exchanged ? "their order, fx, fy, cx, cy, or whether images were cut"
                      : "whether they are of images of another size, or of images that were cut")});
}

void checkOffset(const CameraCalibration& camera, DataFindings& findings) {
  constexpr double kLarge_s = 2.0;
  const double offset = camera.time_offset_s;
  if (std::abs(offset) < kLarge_s) return;
  findings.push_back(
      {Grade::kWarning, "time_offset_large",
       fmt::format("the time offset of {} is {:.4g} s: is it in milliseconds? Then write {:.4g} "
                   "(time_offset_s, timeshift_cam_imu)",
                   camera.name, offset, 1e-3 * offset)});
}

void checkNoise(const ImuCalibration& imu, DataFindings& findings) {
  constexpr double kGyro = 5e-3, kAccel = 0.3;  // the cheapest units have a fifth
  constexpr double kRadians = M_PI / 180.0;
  if (imu.gyro_noise > kGyro) {
    findings.push_back(
        {Grade::kWarning, "imu_noise_large",
         fmt::format("the gyroscope's noise density of {:.3g} rad/s/√Hz is more than the cheapest "
                     "units have: is it in degrees (then {:.3g}), or the deviation of a sample "
                     "(divide it by the root of the rate)?",
                     imu.gyro_noise, kRadians * imu.gyro_noise)});
  }
  if (imu.accel_noise > kAccel) {
    findings.push_back(
        {Grade::kWarning, "imu_noise_large",
         fmt::format("the accelerometer's noise density of {:.3g} m/s²/√Hz is more than the "
                     "cheapest units have: is it in mg (then {:.3g}), or the deviation of a "
                     "sample (divide it by the root of the rate)?",
                     imu.accel_noise, 9.80665e-3 * imu.accel_noise)});
  }
}

}  // namespace

DataFindings checkRigNumbers(const Calibration& calibration) {
  DataFindings findings;
  for (const CameraCalibration& camera : calibration.cameras) {
    checkIntrinsics(camera, findings);
    checkOffset(camera, findings);
  }
  if (calibration.imu) checkNoise(*calibration.imu, findings);
  return findings;
}

}  // namespace perdure::tools

#include "tools/data_check/rig_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/camera/camera_model.h"

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

/// Whether a principal point is near the centre; x and y as shares of the image.
bool isCentral(double x, double y) {
  constexpr double kFar = 0.35;
  return std::abs(x - 0.5) < kFar && std::abs(y - 0.5) < kFar;
}

void checkIntrinsics(const CameraCalibration& camera, DataFindings& findings) {
  constexpr double kLeastFocal = 0.1;  // share of the width; a fisheye over 180 degrees has 0.3
  constexpr double kApart = 1.5;       // ratio of fx and fy
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

/// Share of the pixels, sampled on a grid, that no direction in front of the camera reaches,
/// because the distorted radius decreases again.
double shareOfFolds(const CameraCalibration& calibration) {
  constexpr int kGrid = 24;
  const CameraModel camera(calibration);
  int folded = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Eigen::Vector2d pixel((i % kGrid + 0.5) / kGrid * calibration.width,
                                (i / kGrid + 0.5) / kGrid * calibration.height);
    const auto ray = camera.unproject(pixel);
    if (!ray || !camera.project(ray->homogeneous())) ++folded;
  }
  return static_cast<double>(folded) / (kGrid * kGrid);
}

void checkLens(const CameraCalibration& camera, DataFindings& findings) {
  // A fitted lens model often folds outside the area that the board's corners covered.
  constexpr double kFew = 0.05, kMost = 0.5;
  if (camera.width == 0 || camera.height == 0) return;
  const double folds = shareOfFolds(camera);
  if (folds < kFew) return;
  findings.push_back(
      {folds > kMost ? Grade::kFatal : Grade::kWarning, "lens_folds",
       fmt::format("the distortion of {} folds the image over in {:.0f} % of it: see the order, "
                   "the signs and the model of its coefficients, or calibrate with the board in "
                   "the corners, too",
                   camera.name, 100.0 * folds)});
}

void checkReadout(const CameraCalibration& camera, DataFindings& findings) {
  constexpr double kLarge_s = 0.2;
  if (camera.readout_s < kLarge_s) return;
  findings.push_back({Grade::kWarning, "readout_large",
                      fmt::format("the readout of {} takes {:.4g} s from the first row to the "
                                  "last: is it in milliseconds? Then write {:.4g} (readout_s)",
                                  camera.name, camera.readout_s, 1e-3 * camera.readout_s)});
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
  constexpr double kGyro = 5e-3, kAccel = 0.3;  // five times those of the cheapest units
  constexpr double kRadianOfDegree = M_PI / 180.0;
  for (const auto& [value, name] :
       {std::pair(imu.gyro_noise, "gyroscope"), std::pair(imu.accel_noise, "accelerometer")}) {
    if (value > 0.0) continue;
    findings.push_back({Grade::kWarning, "imu_noise_zero",
                        fmt::format("the {}'s noise density is 0, which no unit has, and all else "
                                    "would count for nothing beside it: write its data sheet's",
                                    name)});
  }
  if (imu.gyro_noise > kGyro) {
    findings.push_back(
        {Grade::kWarning, "imu_noise_large",
         fmt::format("the gyroscope's noise density of {:.3g} rad/s/√Hz is more than the cheapest "
                     "units have: is it in degrees (then {:.3g}), or the deviation of a sample "
                     "(divide it by the root of the rate)?",
                     imu.gyro_noise, kRadianOfDegree * imu.gyro_noise)});
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
    checkLens(camera, findings);
    checkOffset(camera, findings);
    checkReadout(camera, findings);
  }
  if (calibration.imu) checkNoise(*calibration.imu, findings);
  return findings;
}

}  // namespace perdure::tools

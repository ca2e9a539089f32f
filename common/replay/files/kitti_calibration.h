// KITTI's calibration files: raw (calib_cam_to_cam, calib_velo_to_cam, calib_imu_to_velo) and
// tracking (calib/SEQUENCE.txt). The rectified images have no distortion.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "common/types/sensors.h"

namespace perdure::replay {

using ProjectionMatrix = Eigen::Matrix<double, 3, 4>;

struct KittiCalibration {
  ProjectionMatrix P2 =
      ProjectionMatrix::Zero();  ///< projects from rectified camera 0 into the left colour image
  ProjectionMatrix P3 = ProjectionMatrix::Zero();  ///< projects into the right colour image
  RigidTransform
      T_RI;  ///< pose of the IMU (= body) in rectified camera 0, the frame of KITTI's labels
  std::uint32_t width = 0, height = 0;  ///< size of image 2; 0 if it is not in the files

  /// Calibration of cam0 (P2) or cam1 (P3); T_BC follows from P's fourth column and T_RI.
  CameraCalibration camera(const std::string& name) const;
};

/// Reads calib/SEQUENCE.txt. Throws StartupError that names the file or entry and the fix:
/// kUnavailable if it is missing, kData if it is invalid.
KittiCalibration readTrackingCalibration(const std::filesystem::path& file);
/// Reads the three files in `folder` and throws like readTrackingCalibration().
KittiCalibration readRawCalibration(const std::filesystem::path& folder);

/// Image size of a training sequence of KITTI tracking, for drives without images: 1242×375, except
/// for the sequences 0014–0020.
struct ImageSize {
  std::uint32_t width = 1242, height = 375;
};
ImageSize trackingImageSize(const std::string& sequence);

}  // namespace perdure::replay

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
  ProjectionMatrix P2 = ProjectionMatrix::Zero();  ///< pixels from rectified camera 0, left colour
  ProjectionMatrix P3 = ProjectionMatrix::Zero();  ///< right colour
  RigidTransform T_RI;  ///< IMU (= body) into rectified camera 0, in which KITTI's labels are
  std::uint32_t width = 0, height = 0;  ///< of image 2; 0 where the files do not say

  /// cam0 (P2) or cam1 (P3) as the system sees it; T_BC from P's fourth column and T_RI.
  CameraCalibration camera(const std::string& name) const;
};

/// Throws StartupError that names the file or entry with the mend: kUnavailable where it is
/// missing, kData where it is wrong.
KittiCalibration readTrackingCalibration(const std::filesystem::path& file);
/// `folder` holds the three files.
KittiCalibration readRawCalibration(const std::filesystem::path& folder);

/// Sizes of KITTI tracking's training images where no image says so: 1242×375 but for the
/// sequences 0014–0020.
struct ImageSize {
  std::uint32_t width = 1242, height = 375;
};
ImageSize trackingImageSize(const std::string& sequence);

}  // namespace perdure::replay

// Estimates the vertical from level planes in depth images: floors, table tops and seats seen from
// above. Normals of small patches (least squares in inverse depth) are collected over the images.
// The estimate is the direction on which most of them agree, near the mean vertical axis of the
// camera.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::replay {

/// The estimated vertical, and its support.
struct UpEstimate {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit, in the frame of the poses
  std::size_t patches = 0;  ///< number of patches with normals within 5° of `up`
  std::size_t all = 0;      ///< number of all plane patches
};

class LevelPlanes {
 public:
  /// Adds an image. `depth`: CV_16UC1, millimetres; 0 and values above 10 m (including 65535) are
  /// invalid. `K`: lens of the depth camera, without distortion. `R_PC`: rotation of the camera in
  /// the frame P of the poses.
  void add(const cv::Mat& depth, const CameraCalibration& K, const Eigen::Matrix3d& R_PC);
  /// Estimates the vertical near `about`, the mean vertical axis of the camera (of any length).
  /// Reasons: planes_none (fewer than 100 patches agree within 50° of `about`), planes_ambiguous
  /// (another direction, more than 20° off, has more than two thirds as many).
  Result<UpEstimate> up(const Eigen::Vector3d& about) const;

 private:
  std::vector<Eigen::Vector3d> normals_P_;  ///< normals in P, pointing towards the camera
};

}  // namespace perdure::replay

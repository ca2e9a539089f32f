// Which way is up, by the level planes of depth images: floors, table tops and seats that are seen
// from above. Normals of small patches (least squares in
// inverse depth) are gathered over the images; up is where
// most of them agree, near the mean of the camera's own up.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::replay {

/// Up, and what speaks for it.
struct UpEstimate {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit, in the frame of the poses
  std::size_t patches = 0;                        ///< whose normals are within 5° of it
  std::size_t all = 0;                            ///< patches of all planes
};

class LevelPlanes {
 public:
  /// `depth`: CV_16UC1, millimetres; 0, and more than 10 m (65535 too), is no measurement. `K`: its
  /// lens, whose distortion is not used. R_PC: camera in the frame P of the poses.
  void add(const cv::Mat& depth, const CameraCalibration& K, const Eigen::Matrix3d& R_PC);
  /// `about`: roughly up, any length: the mean of the camera's up. Reasons: planes_none (fewer than
  /// 100 patches agree within 50° of it), planes_ambiguous (another direction, more than 20° off,
  /// has more than two thirds as many).
  Result<UpEstimate> up(const Eigen::Vector3d& about) const;

 private:
  std::vector<Eigen::Vector3d> normals_P_;  ///< towards the camera
};

}  // namespace perdure::replay

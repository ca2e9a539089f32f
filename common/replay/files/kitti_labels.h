// Ground truth of KITTI tracking, label_02/SEQUENCE.txt: one line per object and frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/types/detections.h"

namespace perdure::replay {

struct KittiLabel {
  std::uint64_t frame = 0;
  std::int64_t track = -1;
  std::string type;  ///< class as written: Car, Van, DontCare, …
  int truncated = 0, occluded = 0;
  Box box;
  double height = 0, width = 0, length = 0;          ///< metres
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< centre of the box, rectified camera 0
  double rotation_y = 0;                             ///< radians about the camera's y axis

  bool dontCare() const { return type == "DontCare"; }
};

/// Reads the labels. KITTI gives the centre of the box's bottom; `centre` is half the height above
/// it. Throws StartupError(kData) that names each wrong line.
std::vector<KittiLabel> readKittiLabels(const std::filesystem::path& file);

}  // namespace perdure::replay

// Views of a board by a camera: corners with their numbers, frame by frame.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/base/time.h"
#include "common/types/sensors.h"
#include "tools/calibrate/estimate/board.h"

namespace perdure::calibrate {

struct Corner {
  std::size_t id = 0;  ///< index of Board::corner
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct View {
  std::uint64_t frame = 0;
  TimePoint time;  ///< stamp of the image, by the camera's clock
  std::vector<Corner> corners;
};

/// The corners of the board in a grey image, to a few hundredths of a pixel; empty: no board.
std::vector<Corner> findCorners(const Board& board, const cv::Mat& grey);

}  // namespace perdure::calibrate

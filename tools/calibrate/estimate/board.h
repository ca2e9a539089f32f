// Calibration boards: a chessboard, or a grid of AprilTags (family 36h11) with black squares
// between the corners of the tags, as Kalibr uses. Board frame T: origin at the first corner, x
// along columns, y along rows, z away from the viewer; metres. A camera in front of it has z < 0.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/types/sensors.h"

namespace perdure::calibrate {

enum class BoardKind { kChessboard, kAprilGrid };

struct Board {
  BoardKind kind = BoardKind::kAprilGrid;
  int columns = 6, rows = 6;  ///< inner corners of a chessboard, tags of a grid
  double size_m = 0.088;      ///< side of a square, or of a tag's black border
  double gap = 0.3;           ///< gap between tags, as a share of their side

  /// Parses "chessboard:9x6:0.03" or "aprilgrid:6x6:0.088[:0.3]". Throws StartupError(kUsage).
  static Board parse(const std::string& text);
  std::string text() const;

  std::size_t cornerCount() const;
  /// Chessboard: corners row by row. Grid: tag by tag from the first row. The corners of a tag are
  /// clockwise in the viewer's sight, from the upper left.
  Eigen::Vector3d corner(std::size_t id) const;
  /// Upper left and lower right end of the printed area, including a white margin.
  Eigen::Vector2d printFrom() const;
  Eigen::Vector2d printTo() const;
  bool black(const Eigen::Vector2d& point) const;

 private:
  double pitch() const { return size_m * (1.0 + gap); }
};

/// A page to print at 100 %, with a scale bar and the text of the board.
std::string boardSvg(const Board& board);

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

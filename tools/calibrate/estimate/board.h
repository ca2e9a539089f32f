// Calibration boards: a chessboard, or a grid of AprilTags (family 36h11) with black squares
// between the corners of the tags, as in Kalibr. Board frame T, in metres: origin at the first
// corner, x along columns, y along rows, z away from the viewer. A camera in front of the board has
// z < 0.
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
  /// Position of a corner in T. A chessboard's corners are numbered row by row, a grid's tag by tag
  /// from the first row. The corners of a tag are clockwise for the viewer, from the upper left.
  Eigen::Vector3d corner(std::size_t id) const;
  /// printFrom() and printTo(): upper left and lower right corner of the printed area with its
  /// margin.
  Eigen::Vector2d printFrom() const;
  Eigen::Vector2d printTo() const;
  bool black(const Eigen::Vector2d& point) const;

 private:
  double pitch() const { return size_m * (1.0 + gap); }
};

/// A page to print at 100 %, with a scale bar and the board's description.
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

/// The corners of the board in a grey image, to a few hundredths of a pixel; empty if there is no
/// board.
std::vector<Corner> findCorners(const Board& board, const cv::Mat& grey);

}  // namespace perdure::calibrate

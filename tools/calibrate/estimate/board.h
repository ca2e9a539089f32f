// The boards that a camera is calibrated with: a chessboard, or a grid of AprilTags (family 36h11)
// with black squares between the tags' corners, as Kalibr's.
// Board frame T: origin at the first corner, x along columns, y along rows, z away from who looks
// at it; metres. A camera in front of it has z < 0.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace perdure::calibrate {

enum class BoardKind { kChessboard, kAprilGrid };

struct Board {
  BoardKind kind = BoardKind::kAprilGrid;
  int columns = 6, rows = 6;  ///< inner corners of a chessboard, tags of a grid
  double size_m = 0.088;      ///< side of a square, or of a tag's black border
  double gap = 0.3;           ///< between tags, as a share of their side

  /// "chessboard:9x6:0.03" or "aprilgrid:6x6:0.088[:0.3]". Throws StartupError(kUsage).
  static Board parse(const std::string& text);
  std::string text() const;

  std::size_t cornerCount() const;
  /// Chessboard: row by row. Grid: tag by tag from the first row on, the tag's corners clockwise as
  /// seen, from its upper left.
  Eigen::Vector3d corner(std::size_t id) const;
  /// Upper left and lower right end of what is printed, with a white margin.
  Eigen::Vector2d printFrom() const;
  Eigen::Vector2d printTo() const;
  /// Whether the print is black at a point of the board's plane.
  bool black(const Eigen::Vector2d& point) const;

 private:
  double pitch() const { return size_m * (1.0 + gap); }
};

/// A page to print at 100 %, with a scale to measure and the text of the board.
std::string boardSvg(const Board& board);

}  // namespace perdure::calibrate

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "tools/calibrate/estimate/board.h"

namespace perdure::calibrate {
namespace {

using Detector = std::unique_ptr<apriltag_detector_t, decltype(&apriltag_detector_destroy)>;
using Family = std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)>;

const cv::TermCriteria kRefinement(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-4);

double brightness(const cv::Mat& grey, const cv::Point2f& at) {
  cv::Mat patch;
  cv::getRectSubPix(grey, {3, 3}, at, patch);
  return cv::mean(patch)[0];
}

/// Whether OpenCV's order starts at the wrong end: the square after the first corner must be black.
bool isUpsideDown(const Board& board, const cv::Mat& grey, const std::vector<cv::Point2f>& found) {
  double difference = 0.0;  // sum of expected black minus sum of expected white squares
  for (int row = 0; row + 1 < board.rows; ++row) {
    for (int column = 0; column + 1 < board.columns; ++column) {
      const auto at = static_cast<std::size_t>(row * board.columns + column);
      const auto next = at + static_cast<std::size_t>(board.columns);
      const cv::Point2f middle =
          0.25F * (found[at] + found[at + 1] + found[next] + found[next + 1]);
      const bool black = board.black({(column + 0.5) * board.size_m, (row + 0.5) * board.size_m});
      difference += (black ? 1.0 : -1.0) * brightness(grey, middle);
    }
  }
  return difference > 0.0;
}

/// Tests the black and white quadrants around a corner. Returns 1 if the quadrants a + b and -a - b
/// are black, -1 if they are white, and 0 if opposite quadrants differ.
int crossingAt(const cv::Mat& grey, const cv::Point2f& corner, const cv::Point2f& a,
               const cv::Point2f& b) {
  const double one = brightness(grey, corner + a + b), across = brightness(grey, corner - a - b);
  const double beside = brightness(grey, corner + a - b), other = brightness(grey, corner - a + b);
  const double low = std::min({one, across, beside, other});
  const double range = std::max({one, across, beside, other}) - low;
  const double darker = std::min(beside, other) - std::max(one, across);
  const double lighter = std::min(one, across) - std::max(beside, other);
  if (range < 20.0 || std::max(darker, lighter) < 0.3 * range) return 0;
  return darker > lighter ? 1 : -1;
}

/// Whether all corners are crossings with alternating colours; a board detected one square beside
/// has other corners too.
bool areCrossings(const Board& board, const cv::Mat& grey, const std::vector<cv::Point2f>& found) {
  constexpr float kStep = 0.3F;  // share of a square
  const auto at = [&](int column, int row) {
    return found[static_cast<std::size_t>(row * board.columns + column)];
  };
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const int right = std::min(column, board.columns - 2), below = std::min(row, board.rows - 2);
      const cv::Point2f a = kStep * (at(right + 1, row) - at(right, row));
      const cv::Point2f b = kStep * (at(column, below + 1) - at(column, below));
      if (crossingAt(grey, at(column, row), a, b) == 0) return false;
    }
  }
  return true;
}

std::vector<Corner> findChessboard(const Board& board, const cv::Mat& grey) {
  std::vector<cv::Point2f> found;
  const cv::Size size(board.columns, board.rows);
  if (!cv::findChessboardCornersSB(grey, size, found, cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return {};
  }
  // Refines the corners by the adjacent edges, because the detector's bias is some hundredths of a
  // px.
  double side = 1e9;
  for (std::size_t i = 1; i < found.size(); ++i) {
    side = std::min(side, cv::norm(found[i] - found[i - 1]));
  }
  const int half = std::clamp(static_cast<int>(0.3 * side), 2, 6);
  cv::cornerSubPix(grey, found, {half, half}, {-1, -1}, kRefinement);
  if (!areCrossings(board, grey, found)) return {};
  if (isUpsideDown(board, grey, found)) std::ranges::reverse(found);
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < found.size(); ++i) {
    corners.push_back({i, {found[i].x, found[i].y}});
  }
  return corners;
}

/// Refines the corners of a tag as crossings of edges; returns false for corners that are no
/// crossings.
std::vector<bool> refineCrossings(const cv::Mat& grey, double side_px,
                                  std::vector<cv::Point2f>& pixels) {
  constexpr double kFarthest = 2.0;
  constexpr float kStep = 0.09F;  // share of the tag's side, within its border
  const int half = std::clamp(static_cast<int>(0.12 * side_px), 2, 6);
  const std::vector<cv::Point2f> before = pixels;
  cv::cornerSubPix(grey, pixels, {half, half}, {-1, -1}, kRefinement);
  std::vector<bool> good;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const cv::Point2f& p = pixels[i];
    const bool inside = p.x > half + 1 && p.y > half + 1 && p.x < grey.cols - half - 2 &&
                        p.y < grey.rows - half - 2;
    good.push_back(inside && cv::norm(p - before[i]) < kFarthest &&
                   crossingAt(grey, p, kStep * (before[(i + 1) % 4] - p),
                              kStep * (before[(i + 3) % 4] - p)) == 1);
  }
  return good;
}

std::vector<Corner> findAprilGrid(const Board& board, const cv::Mat& grey) {
  const Family family(tag36h11_create(), tag36h11_destroy);
  const Detector detector(apriltag_detector_create(), apriltag_detector_destroy);
  apriltag_detector_add_family_bits(detector.get(), family.get(), 1);
  detector->quad_decimate = 1.0F;
  detector->nthreads = 1;
  const cv::Mat packed = grey.isContinuous() ? grey : grey.clone();
  image_u8_t image = {packed.cols, packed.rows, static_cast<std::int32_t>(packed.step[0]),
                      packed.data};
  const std::unique_ptr<zarray_t, decltype(&apriltag_detections_destroy)> found(
      apriltag_detector_detect(detector.get(), &image), apriltag_detections_destroy);
  std::vector<Corner> corners;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* tag = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&tag));
    if (tag->hamming > 0 || tag->id >= board.columns * board.rows) continue;
    // AprilTag's order is lower left, lower right, upper right, upper left. Its integer coordinates
    // are at the corners of pixels.
    std::vector<cv::Point2f> pixels;
    double side = 1e9;
    for (const int which : {3, 2, 1, 0}) {
      const auto& p = tag->p[which];
      const auto& q = tag->p[(which + 1) % 4];
      pixels.emplace_back(static_cast<float>(p[0] - 0.5), static_cast<float>(p[1] - 0.5));
      side = std::min(side, std::hypot(p[0] - q[0], p[1] - q[1]));
    }
    const std::vector<bool> good = refineCrossings(packed, side, pixels);
    for (std::size_t k = 0; k < 4; ++k) {
      if (!good[k]) continue;
      corners.push_back({4 * static_cast<std::size_t>(tag->id) + k, {pixels[k].x, pixels[k].y}});
    }
  }
  return corners;
}

}  // namespace

std::vector<Corner> findCorners(const Board& board, const cv::Mat& grey) {
  auto corners = board.kind == BoardKind::kChessboard ? findChessboard(board, grey)
                                                      : findAprilGrid(board, grey);
  std::ranges::sort(corners, {}, &Corner::id);
  const auto twice = std::ranges::adjacent_find(
      corners, [](const Corner& a, const Corner& b) { return a.id == b.id; });
  return twice == corners.end() ? corners : std::vector<Corner>();
}

}  // namespace perdure::calibrate

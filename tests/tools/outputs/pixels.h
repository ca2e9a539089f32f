// Checks of pictures: whether a place has a colour, and which share of a line has it.
#pragma once

#include <opencv2/core/mat.hpp>

#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {

inline double apart(const cv::Vec3b& pixel, const Colour& colour) {
  double most = 0.0;
  for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(pixel[c] - colour[c]));
  return most;
}

/// Returns whether a pixel within `reach` of a place has the colour, to within `tolerance` per
/// channel.
inline bool hasColour(const cv::Mat& picture, const cv::Point2d& at, const Colour& colour,
                      int reach = 1, double tolerance = 60.0) {
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const cv::Point p(cvRound(at.x) + x, cvRound(at.y) + y);
      if (cv::Rect({}, picture.size()).contains(p) &&
          apart(picture.at<cv::Vec3b>(p), colour) <= tolerance)
        return true;
    }
  }
  return false;
}

/// Returns the share of the points between a and b, ends included, that have the colour.
inline double coverage(const cv::Mat& picture, const cv::Point2d& a, const cv::Point2d& b,
                       const Colour& colour, double tolerance = 60.0) {
  constexpr int kPoints = 200;
  int hits = 0;
  for (int i = 0; i <= kPoints; ++i) {
    hits +=
        hasColour(picture, a + (b - a) * (static_cast<double>(i) / kPoints), colour, 1, tolerance)
            ? 1
            : 0;
  }
  return hits / (kPoints + 1.0);
}

inline int count(const cv::Mat& picture, const Colour& colour, double tolerance = 2.0) {
  int pixels = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      pixels += apart(picture.at<cv::Vec3b>(y, x), colour) <= tolerance ? 1 : 0;
    }
  }
  return pixels;
}

}  // namespace perdure::tools

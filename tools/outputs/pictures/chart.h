// A line chart in a part of a picture: axes with ticks and numbers, curves, shaded spans.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {

/// Returns at most `most` round numbers that cover [low, high].
std::vector<double> ticksOf(double low, double high, int most);
/// Returns the largest 1, 2 or 5 times a power of ten that does not exceed `value` > 0.
double roundBelow(double value);
/// Formats a number with as few digits as necessary; never "-0".
std::string numberText(double value);

class Chart {
 public:
  struct Range {
    double low = 0.0, high = 1.0;
  };
  /// `area` is the area of the curves; numbers are to the left of it and below it.
  Chart(cv::Mat& picture, const cv::Rect& area, const Range& x, const Range& y);

  void shade(double from, double to, const Colour& colour, double opacity);
  void drawGrid(bool with_x_numbers);
  /// Draws a curve through points (x, y). Values outside the range are drawn at its edge.
  void drawCurve(const std::vector<cv::Point2d>& points, Stroke stroke);
  cv::Point2d at(double x, double y) const;

 private:
  cv::Mat& picture_;
  cv::Rect area_;
  Range x_, y_;
};

}  // namespace perdure::tools

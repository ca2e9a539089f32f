// What the pictures share: colours of classes, lines that are solid or dashed, labels that stay
// inside the picture and beside one another.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace perdure::tools {

using Colour = cv::Scalar;  ///< blue, green, red
using Polyline = std::vector<cv::Point2d>;

inline const Colour kInk(60, 50, 40), kPaper(252, 250, 248), kGrid(228, 226, 222);
/// Nothing but truth has this colour.
inline const Colour kTruthColour(150, 0, 220);

/// Always the same for a name; the usual classes differ clearly.
Colour classColour(const std::string& name);
/// `share` of the way towards `to`.
Colour mixed(const Colour& from, const Colour& to, double share);

struct Stroke {
  Colour colour;
  int thickness = 1;
  bool dashed = false;
  double dash = 7.0, gap = 5.0;  ///< pixels
};

/// Shortens the line to its part inside; false where there is none.
bool clip(const cv::Rect2d& area, cv::Point2d& a, cv::Point2d& b);
/// Joins the points, wherever they are; dashes run on over the joints.
void drawLine(cv::Mat& image, const Polyline& line, const Stroke& stroke);
void drawClosed(cv::Mat& image, Polyline corners, const Stroke& stroke);
/// Fills a convex outline, `opacity` in [0, 1].
void drawFilled(cv::Mat& image, const Polyline& corners, const Colour& colour, double opacity);
/// Mixes a rectangle of the image with a colour; the part outside the image is left out.
void tint(cv::Mat& image, const cv::Rect& area, const Colour& colour, double opacity);

struct TextStyle {
  double scale = 0.45;
  int thickness = 1;
};
cv::Size sizeOf(const std::string& text, const TextStyle& style = {});
/// `at` is the left end of the base line.
void drawText(cv::Mat& image, const std::string& text, const cv::Point& at, const Colour& colour,
              const TextStyle& style = {});

/// A place for a rectangle of `size` whose lower left corner would like to be at `at`: inside
/// `area`, and off the taken ones where there is such a place nearby. A rectangle that is larger
/// than the area begins at its upper left corner.
cv::Rect placeFor(const cv::Size& size, const cv::Point& at, const cv::Rect& area,
                  const std::vector<cv::Rect>& taken);

/// As PNG. Throws StartupError(kInputOutput) where the file cannot be written whole.
void writePicture(const cv::Mat& picture, const std::filesystem::path& file);

}  // namespace perdure::tools

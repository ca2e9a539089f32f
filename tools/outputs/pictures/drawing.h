// Functions that the pictures share: colours of classes, lines, and labels that do not overlap.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace perdure::tools {

using Colour = cv::Scalar;  ///< blue, green, red
using Polyline = std::vector<cv::Point2d>;

inline const Colour kInk(60, 50, 40), kPaper(252, 250, 248), kGrid(228, 226, 222);
/// The colour of ground truth; nothing else has it.
inline const Colour kTruthColour(150, 0, 220);

/// The colour of a class, the same in all pictures. Colours of common classes differ clearly.
Colour classColour(const std::string& name);
Colour mixed(const Colour& from, const Colour& to, double share);

struct Stroke {
  Colour colour;
  int thickness = 1;
  bool dashed = false;
  double dash = 7.0, gap = 5.0;  ///< pixels
};

/// Clips the line from a to b to the area; returns false if the line is completely outside.
bool clip(const cv::Rect2d& area, cv::Point2d& a, cv::Point2d& b);
/// Connects points, which may be outside the image. Dashes continue across the joints.
void drawLine(cv::Mat& image, const Polyline& line, const Stroke& stroke);
void drawClosed(cv::Mat& image, Polyline corners, const Stroke& stroke);
void drawFilled(cv::Mat& image, const Polyline& corners, const Colour& colour, double opacity);
/// Mixes a rectangle, clipped to the image, with a colour.
void tint(cv::Mat& image, const cv::Rect& area, const Colour& colour, double opacity);

struct TextStyle {
  double scale = 0.45;
  int thickness = 1;
};
cv::Size sizeOf(const std::string& text, const TextStyle& style = {});
/// Draws text; `at` is the left end of its base line.
void drawText(cv::Mat& image, const std::string& text, const cv::Point& at, const Colour& colour,
              const TextStyle& style = {});

/// Returns a rectangle of `size` inside `area`, with its lower left corner as near as possible
/// above or below `at`. It overlaps no taken rectangle if there is free space nearby. If it is
/// larger than the area, it starts at the area's upper left corner.
cv::Rect placeFor(const cv::Size& size, const cv::Point& at, const cv::Rect& area,
                  const std::vector<cv::Rect>& taken);

/// Writes a PNG. Throws StartupError(kInputOutput) if the file is incomplete.
void writePicture(const cv::Mat& picture, const std::filesystem::path& file);

}  // namespace perdure::tools

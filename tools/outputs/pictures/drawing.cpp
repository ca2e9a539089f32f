#include "tools/outputs/pictures/drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/base/checked_file.h"
#include "common/base/ids.h"

namespace perdure::tools {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kShift = 4;  // fractional bits: coordinates of cv::line are in 1/16 px

Colour rgb(int r, int g, int b) { return {double(b), double(g), double(r)}; }

cv::Point fine(const cv::Point2d& p) {
  const double unit = 1 << kShift;
  return {static_cast<int>(std::lround(p.x * unit)), static_cast<int>(std::lround(p.y * unit))};
}

/// The image's area with a margin of its own size. Lines are clipped to it, because coordinates of
/// cv::line must stay small.
cv::Rect2d around(const cv::Mat& image) {
  return {-1.0 * image.cols, -1.0 * image.rows, 3.0 * image.cols, 3.0 * image.rows};
}

void piece(cv::Mat& image, const cv::Point2d& a, const cv::Point2d& b, const Stroke& stroke) {
  cv::line(image, fine(a), fine(b), stroke.colour, stroke.thickness, cv::LINE_AA, kShift);
}

/// Draws dashes from a to b, starting `run` pixels into the pattern; returns the phase at b.
double dashes(cv::Mat& image, const cv::Point2d& a, const cv::Point2d& b, const Stroke& stroke,
              double run) {
  const double length = cv::norm(b - a), period = stroke.dash + stroke.gap;
  for (double at = 0.0; at < length;) {
    const double phase = std::fmod(run + at, period);
    const bool on = phase < stroke.dash;
    const double step = std::max(1e-6, (on ? stroke.dash : period) - phase);
    const double end = std::min(length, at + step);
    if (on) piece(image, a + (b - a) * (at / length), a + (b - a) * (end / length), stroke);
    at = end;
  }
  return std::fmod(run + length, period);
}

}  // namespace

Colour classColour(const std::string& name) {
  static const std::map<std::string, Colour> kKnown = {
      {"car", rgb(31, 119, 200)},    {"van", rgb(0, 165, 170)},
      {"truck", rgb(20, 75, 130)},   {"bus", rgb(90, 90, 200)},
      {"person", rgb(240, 120, 20)}, {"bicycle", rgb(50, 160, 60)},
      {"cyclist", rgb(50, 160, 60)}, {"motorcycle", rgb(150, 90, 40)},
      {"chair", rgb(125, 85, 200)},  {"dining table", rgb(160, 110, 60)},
      {"monitor", rgb(0, 150, 110)}, {"couch", rgb(205, 70, 60)},
      {"toy", rgb(215, 165, 0)},     {"tram", rgb(120, 60, 90)},
      {"other", rgb(120, 120, 120)},
  };
  static const std::array<Colour, 6> kFurther = {rgb(130, 150, 30), rgb(70, 130, 150),
                                                 rgb(190, 100, 90), rgb(100, 110, 170),
                                                 rgb(170, 140, 80), rgb(80, 150, 110)};
  const auto found = kKnown.find(name);
  return found != kKnown.end() ? found->second : kFurther[digest(name) % kFurther.size()];
}

Colour mixed(const Colour& from, const Colour& to, double share) {
  return from * (1.0 - share) + to * share;
}

bool clip(const cv::Rect2d& area, cv::Point2d& a, cv::Point2d& b) {
  // Liang and Barsky: each of the four sides limits the range of the line's parameter.
  const cv::Point2d way = b - a;
  double from = 0.0, to = 1.0;
  for (const auto& [step, room] : {std::pair{-way.x, a.x - area.x},
                                   {way.x, area.br().x - a.x},
                                   {-way.y, a.y - area.y},
                                   {way.y, area.br().y - a.y}}) {
    if (step == 0.0) {
      if (room < 0.0) return false;
    } else if (step < 0.0) {
      from = std::max(from, room / step);
    } else {
      to = std::min(to, room / step);
    }
  }
  if (!(from <= to)) return false;
  b = a + way * to;
  a = a + way * from;
  return true;
}

void drawLine(cv::Mat& image, const Polyline& line, const Stroke& stroke) {
  double run = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) {
    cv::Point2d a = line[i - 1], b = line[i];
    if (!clip(around(image), a, b)) continue;
    if (stroke.dashed)
      run = dashes(image, a, b, stroke, run);
    else
      piece(image, a, b, stroke);
  }
}

void drawClosed(cv::Mat& image, Polyline corners, const Stroke& stroke) {
  if (corners.empty()) return;
  corners.push_back(corners.front());
  drawLine(image, corners, stroke);
}

void drawFilled(cv::Mat& image, const Polyline& corners, const Colour& colour, double opacity) {
  std::vector<cv::Point> points;
  for (const auto& corner : corners) {
    if (!around(image).contains(corner)) return;
    points.emplace_back(cv::Point2i(corner));
  }
  if (points.empty()) return;
  const cv::Rect area = cv::boundingRect(points) & cv::Rect({}, image.size());
  if (area.empty()) return;
  cv::Mat part = image(area), filled = part.clone();
  cv::fillConvexPoly(image, points, colour, cv::LINE_AA);
  cv::addWeighted(part, opacity, filled, 1.0 - opacity, 0.0, part);
}

void tint(cv::Mat& image, const cv::Rect& area, const Colour& colour, double opacity) {
  const cv::Rect inside = area & cv::Rect({}, image.size());
  if (inside.empty()) return;
  cv::Mat part = image(inside);
  part.convertTo(part, -1, 1.0 - opacity);
  cv::add(part, colour * opacity, part);
}

cv::Size sizeOf(const std::string& text, const TextStyle& style) {
  return cv::getTextSize(text, kFont, style.scale, style.thickness, nullptr);
}

void drawText(cv::Mat& image, const std::string& text, const cv::Point& at, const Colour& colour,
              const TextStyle& style) {
  cv::putText(image, text, at, kFont, style.scale, colour, style.thickness, cv::LINE_AA);
}

cv::Rect placeFor(const cv::Size& size, const cv::Point& at, const cv::Rect& area,
                  const std::vector<cv::Rect>& taken) {
  const auto inside = [&](int x, int y) {
    return cv::Rect(std::max(area.x, std::min(x, area.br().x - size.width)),
                    std::max(area.y, std::min(y, area.br().y - size.height)), size.width,
                    size.height);
  };
  const auto isFree = [&](const cv::Rect& place) {
    return std::ranges::none_of(taken,
                                [&](const cv::Rect& other) { return (place & other).area() > 0; });
  };
  const cv::Rect wanted = inside(at.x, at.y - size.height);
  constexpr int kTries = 12;
  for (int step = 0; step < kTries; ++step) {  // tries `at`, then above, below, farther above, …
    const int away = (step + 1) / 2 * (step % 2 == 1 ? -1 : 1) * (size.height + 1);
    const cv::Rect place = inside(at.x, at.y - size.height + away);
    if (isFree(place)) return place;
  }
  return wanted;
}

void writePicture(const cv::Mat& picture, const std::filesystem::path& file) {
  std::vector<uchar> bytes;
  if (!cv::imencode(".png", picture, bytes)) throwUnwritten(file, "the picture cannot be packed");
  writeChecked(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace perdure::tools

#include "tools/outputs/pictures/map_legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {
namespace {

constexpr int kLegendWidth = 252, kLine = 25;

std::map<std::string, int> countsOf(const MapContent& content) {
  std::map<std::string, int> counts;
  for (const auto& object : content.objects) ++counts[object.class_name];
  return counts;
}

std::ptrdiff_t loopsOf(const MapContent& content, bool believed) {
  return std::ranges::count(content.loops, believed, &LoopLine::believed);
}

/// Draws the entries of the legend in a column. Sizes are in units of view.text.
class Legend {
 public:
  Legend(cv::Mat& picture, const MapView& view)
      : picture_(picture), unit_(view.text), x_(view.area.br().x + 20 * unit_), y_(view.area.y) {}

  /// Adds an entry and returns the area of its symbol, 34 × 14 units.
  cv::Rect2d entry(const std::string& text) {
    const cv::Rect2d sign(x_, y_ + 5 * unit_, 34 * unit_, 14 * unit_);
    drawText(picture_, text, cv::Point2d(x_ + 44 * unit_, y_ + 17 * unit_), kInk, style());
    y_ += kLine * unit_;
    return sign;
  }
  void skip(double lines) { y_ += lines * kLine * unit_; }
  void line(const std::string& text, Stroke stroke) {
    const cv::Rect2d at = entry(text);
    stroke.thickness = thick(stroke.thickness);
    const cv::Point2d left(at.x, at.y + at.height / 2);
    drawLine(picture_, {left, left + cv::Point2d(at.width, 0)}, stroke);
  }
  void box(const std::string& text, Stroke stroke, double fill) {
    const cv::Rect2d at = entry(text);
    stroke.thickness = thick(stroke.thickness);
    const Polyline corners = {at.tl(), {at.br().x, at.y}, at.br(), {at.x, at.br().y}};
    if (fill > 0) drawFilled(picture_, corners, stroke.colour, fill);
    drawClosed(picture_, corners, stroke);
  }
  void ellipse(const std::string& text, const Colour& colour) {
    const cv::Rect2d at = entry(text);
    cv::ellipse(picture_, cv::RotatedRect((at.tl() + at.br()) / 2, at.size(), 0), colour, 1,
                cv::LINE_AA);
  }
  void dots(const std::string& text, const Colour& colour) {
    const cv::Rect2d at = entry(text);
    for (const auto& [x, y] :
         {std::pair{.1, .6}, {.3, .2}, {.45, .8}, {.6, .4}, {.8, .7}, {.9, .1}}) {
      cv::rectangle(picture_,
                    cv::Rect(cv::Point(at.tl() + cv::Point2d(x * at.width, y * at.height)),
                             cv::Size(thick(2), thick(2))),
                    colour, cv::FILLED);
    }
  }
  void rings(const std::string& text) {
    const cv::Rect2d at = entry(text);
    for (const double x : {0.15, 0.5, 0.85}) {
      const cv::Point centre(at.tl() + cv::Point2d(x * at.width, 0.5 * at.height));
      cv::circle(picture_, centre, thick(3), kInk, cv::FILLED, cv::LINE_AA);
      cv::circle(picture_, centre, thick(2), kPaper, cv::FILLED, cv::LINE_AA);
    }
  }
  cv::Point2d corner() const { return {x_, y_}; }
  TextStyle style() const { return {0.48 * unit_, thick(1)}; }
  int thick(double width) const {
    return std::max(1, static_cast<int>(std::lround(unit_ * width)));
  }
  double unit() const { return unit_; }

 private:
  cv::Mat& picture_;
  double unit_, x_, y_;
};

/// Draws the axes, and the direction of north if it is known.
void drawCompass(cv::Mat& picture, Legend& legend, const MapContent& content) {
  const double unit = legend.unit();
  const cv::Point2d from = legend.corner() + cv::Point2d(56 * unit, 78 * unit);
  const auto arrow = [&](double yaw, const Colour& colour, const std::string& text) {
    const cv::Point2d way(std::cos(yaw), -std::sin(yaw));
    cv::arrowedLine(picture, from, from + way * 46 * unit, colour, legend.thick(2), cv::LINE_AA, 0,
                    0.2);
    const cv::Size size = sizeOf(text, legend.style());
    drawText(picture, text,
             from + way * 58 * unit + cv::Point2d(-size.width / 2.0, size.height / 2.0), colour,
             legend.style());
  };
  arrow(0.0, kInk, "x");
  arrow(std::numbers::pi / 2, kInk, "y");
  if (content.yaw_of_north) arrow(*content.yaw_of_north, classColour("couch"), "N");
  legend.skip(4.4);
  legend.entry(content.in_M ? "M, metres; yaw 0 is x" : "W, metres; yaw 0 is x");
}

int linesOf(const MapContent& content) {
  return 15 + static_cast<int>(countsOf(content).size()) + (content.truth ? 1 : 0) +
         (content.anchors.empty() ? 0 : 3);
}

}  // namespace

Stroke loopStroke(bool believed, double text) {
  const int thickness = std::max(1, static_cast<int>(std::lround(text)));
  if (believed) return {Colour(40, 150, 235), thickness};
  return {Colour(60, 70, 205), thickness, true, 5.0 * text, 4.0 * text};
}

double fillOf(Visibility visibility) {
  switch (visibility) {
    case Visibility::kVisible:
    case Visibility::kPartial:
      return 0.65;
    case Visibility::kOccluded:
      return 0.0;
    default:
      return 0.2;
  }
}

cv::Size pictureSize(const MapContent& content, const MapView& view) {
  const int legend = static_cast<int>(view.text * (linesOf(content) * kLine + 20));
  const int map = view.area.br().y + static_cast<int>(34 * view.text);
  return {view.area.br().x + static_cast<int>(kLegendWidth * view.text), std::max(map, legend)};
}

void drawScaleBar(cv::Mat& picture, const MapView& view) {
  const int thickness = std::max(3, static_cast<int>(3 * view.text));
  const int length = static_cast<int>(std::lround(view.bar_m * view.scale));
  const std::string text = fmt::format("{:g} m", view.bar_m);
  const TextStyle style{0.5 * view.text, std::max(1, static_cast<int>(view.text))};
  const cv::Size size = sizeOf(text, style);
  const int pad = static_cast<int>(6 * view.text);
  tint(picture,
       {view.bar.x - pad, view.bar.y - size.height - 3 * pad,
        std::max(length, size.width) + 2 * pad, size.height + 4 * pad},
       kPaper, 0.85);
  cv::rectangle(picture, cv::Rect(view.bar, cv::Size(length, thickness)), kInk, cv::FILLED);
  drawText(picture, text, view.bar - cv::Point(0, pad), kInk, style);
}

void drawMapLegend(cv::Mat& picture, const MapContent& content, const MapView& view) {
  Legend legend(picture, view);
  for (const auto& [name, count] : countsOf(content)) {
    legend.box(fmt::format("{}: {}", name, count), {classColour(name), 2}, 0.65);
  }
  const auto beyond = std::ranges::count_if(content.objects, [&](const ObjectGlance& object) {
    return !view.area.contains(cv::Point(view.at(object.p_W.head<2>())));
  });
  if (beyond > 0) legend.entry(fmt::format("{} beyond the border", beyond));
  legend.skip(0.4);
  if (content.truth) legend.box("truth", {kTruthColour, 1}, 0.0);
  const Colour grey(110, 110, 110);
  legend.box("in sight at the end", {grey, 2}, fillOf(Visibility::kVisible));
  legend.box("out of view", {grey, 2}, fillOf(Visibility::kOutOfView));
  legend.box("hidden", {grey, 1, true, 4.0, 4.0}, 0.0);
  legend.ellipse("2 sigma of the centre", grey);
  legend.line("the way (disc: start)", {kInk, 2});
  if (!content.landmarks.empty()) legend.dots("sparse points", kDots);
  if (!content.anchors.empty()) legend.rings("anchors");
  for (const bool believed : {true, false}) {
    const auto loops = loopsOf(content, believed);
    const char* text = believed ? "loops: {}" : "loops, not believed: {}";
    if (loops > 0) legend.line(fmt::format(fmt::runtime(text), loops), loopStroke(believed, 1.0));
  }
  drawCompass(picture, legend, content);
}

}  // namespace perdure::tools

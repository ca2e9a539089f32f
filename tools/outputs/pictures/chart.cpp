#include "tools/outputs/pictures/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace perdure::tools {
namespace {
constexpr TextStyle kNumbers{0.42};
}

double roundBelow(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  for (const double nice : {5.0, 2.0}) {
    if (nice * power <= value * (1.0 + 1e-9)) return nice * power;
  }
  return power;
}

std::string numberText(double value) {
  return fmt::format("{:.6g}", std::abs(value) < 1e-12 ? 0.0 : value);
}

std::vector<double> ticksOf(double low, double high, int most) {
  if (!(high > low)) return {low};
  double step = roundBelow((high - low) / std::max(1, most - 1));
  const auto count = [&] {
    return std::floor(high / step + 1e-9) - std::ceil(low / step - 1e-9) + 1.0;
  };
  while (count() > most) step = roundBelow(2.51 * step);
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) {
    ticks.push_back(i * step);
  }
  return ticks;
}

Chart::Chart(cv::Mat& picture, const cv::Rect& area, const Range& x, const Range& y)
    : picture_(picture), area_(area), x_(x), y_(y) {
  if (!(x_.high > x_.low)) x_.high = x_.low + 1.0;
  if (!(y_.high > y_.low)) y_.high = y_.low + 1.0;
}

cv::Point2d Chart::at(double x, double y) const {
  return {area_.x + (x - x_.low) / (x_.high - x_.low) * (area_.width - 1),
          area_.y + (y_.high - y) / (y_.high - y_.low) * (area_.height - 1)};
}

void Chart::shade(double from, double to, const Colour& colour, double opacity) {
  const cv::Point2d a = at(from, y_.high), b = at(to, y_.low);
  const int left = static_cast<int>(std::floor(a.x)), right = static_cast<int>(std::ceil(b.x));
  tint(picture_, cv::Rect(left, area_.y, right - left + 1, area_.height) & area_, colour, opacity);
}

void Chart::drawGrid(bool with_x_numbers) {
  const Colour pale = mixed(kInk, kPaper, 0.88);
  for (const double y : ticksOf(y_.low, y_.high, 5)) {
    const cv::Point2d p = at(x_.low, y);
    drawLine(picture_, {p, at(x_.high, y)}, {pale});
    const std::string number = numberText(y);
    const cv::Size size = sizeOf(number, kNumbers);
    drawText(picture_, number, cv::Point(p) + cv::Point(-size.width - 7, size.height / 2), kInk,
             kNumbers);
  }
  for (const double x : ticksOf(x_.low, x_.high, 10)) {
    const cv::Point2d p = at(x, y_.low);
    drawLine(picture_, {p, p + cv::Point2d(0, 4)}, {kInk});
    if (!with_x_numbers) continue;
    const std::string number = numberText(x);
    drawText(picture_, number, cv::Point(p) + cv::Point(-sizeOf(number, kNumbers).width / 2, 19),
             kInk, kNumbers);
  }
  cv::rectangle(picture_, area_, kInk, 1);
}

void Chart::drawCurve(const std::vector<cv::Point2d>& points, Stroke stroke) {
  Polyline line;
  for (const auto& p : points) line.push_back(at(p.x, std::clamp(p.y, y_.low, y_.high)));
  drawLine(picture_, line, stroke);
}

}  // namespace perdure::tools

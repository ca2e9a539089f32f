#include "tools/outputs/pictures/loop_chart.h"

#include <algorithm>
#include <utility>

namespace perdure::tools {
namespace {

const Colour kWColour(150, 145, 140), kThenColour(200, 119, 31), kEndColour(60, 140, 40);
const Colour kLoopColour(40, 150, 235), kFoundColour(180, 60, 120), kBackColour(60, 70, 205);

Colour colourOf(EventKind kind) {
  return kind == EventKind::kRelocalised     ? kFoundColour
         : kind == EventKind::kLoopWithdrawn ? kBackColour
                                             : kLoopColour;
}

double topOf(const BodyErrors& errors) {
  double top = 0.1;
  for (const auto& point : errors.points) {
    for (const auto& value : {point.in_W, point.then, point.at_end}) {
      if (value) top = std::max(top, 1.08 * *value);
    }
  }
  return top;
}

template <class Value>
void drawSeries(Chart& chart, const BodyErrors& errors, const Stroke& stroke, Value&& value) {
  std::vector<cv::Point2d> points;
  for (const BodyErrors::Point& point : errors.points) {
    if (const std::optional<double> y = value(point)) {
      points.emplace_back(static_cast<double>(point.frame), *y);
      continue;
    }
    chart.drawCurve(points, stroke);
    points.clear();
  }
  chart.drawCurve(points, stroke);
}

/// Draws a pale line over the whole height, and a tip on the upper border.
void drawMark(cv::Mat& picture, const cv::Rect& area, const Chart& chart,
              const BodyErrors::Mark& mark, double top) {
  const cv::Point2d at = chart.at(static_cast<double>(mark.frame), top);
  if (at.x < area.x || at.x > area.br().x) return;
  const Colour colour = colourOf(mark.kind);
  drawLine(picture, {at, {at.x, area.br().y - 1.0}},
           {mixed(colour, kPaper, 0.55), 1, mark.kind == EventKind::kLoopWithdrawn, 4.0, 4.0});
  drawFilled(picture, {at, at + cv::Point2d(-4, -7), at + cv::Point2d(4, -7)}, colour, 1.0);
}

/// Draws legend entries from right to left over the area.
class LegendLine {
 public:
  LegendLine(cv::Mat& picture, const cv::Rect& area)
      : picture_(picture), x_(area.br().x), y_(area.y - 20) {}
  void line(const std::string& text, const Stroke& stroke) {
    const int x = place(text, 28);
    drawLine(picture_, {cv::Point(x, y_ - 5), cv::Point(x + 28, y_ - 5)}, stroke);
  }
  void tip(const std::string& text, const Colour& colour) {
    const cv::Point2d at(place(text, 10) + 5, y_ - 1);
    drawFilled(picture_, {at, at + cv::Point2d(-4, -7), at + cv::Point2d(4, -7)}, colour, 1.0);
  }

 private:
  int place(const std::string& text, int sign) {
    constexpr TextStyle kStyle{0.45};
    x_ -= sizeOf(text, kStyle).width;
    drawText(picture_, text, {x_, y_}, kInk, kStyle);
    x_ -= sign + 8;
    const int at = x_;
    x_ -= 22;
    return at;
  }
  cv::Mat& picture_;
  int x_, y_;
};

void drawLegend(cv::Mat& picture, const cv::Rect& area, const BodyErrors& errors) {
  LegendLine legend(picture, area);
  const auto has = [&](EventKind kind) {
    return std::ranges::any_of(errors.marks, [&](const auto& mark) { return mark.kind == kind; });
  };
  if (has(EventKind::kLoopWithdrawn)) legend.tip("withdrawn", kBackColour);
  if (has(EventKind::kRelocalised)) legend.tip("found on the map", kFoundColour);
  if (has(EventKind::kLoopClosed)) legend.tip("loop closed", kLoopColour);
  if (errors.against_truth) {
    legend.line("on the map in the end", {kEndColour, 2});
    legend.line("on the map, then", {kThenColour, 2});
    legend.line("in W", {kWColour, 2, true, 6.0, 5.0});
  }
  drawText(picture, errors.against_truth ? "the body: error, m" : "the body: moved by the map, m",
           {area.x, area.y - 18}, kInk, {0.6, 2});
}

}  // namespace

BodyErrors bodyErrors(const std::map<std::uint64_t, replay::StampedPose>& poses,
                      const DriveInMap& in_map, std::vector<BodyErrors::Mark> marks,
                      const PictureTruth* truth) {
  BodyErrors errors;
  errors.marks = std::move(marks);
  if (errors.marks.empty()) return errors;
  errors.against_truth = truth != nullptr && !truth->path.empty();
  const RigidTransform T_WM = in_map.T_MW_begin().inverse();
  for (const auto& [frame, pose] : poses) {
    const auto then = in_map.then.find(frame);
    BodyErrors::Point point{frame, {}, {}, {}};
    if (!errors.against_truth) {
      if (then != in_map.then.end()) point.then = (then->second - pose.T_WB.p).norm();
      errors.points.push_back(point);
      continue;
    }
    const auto there = truth->path.find(frame);
    if (there == truth->path.end()) continue;
    point.in_W = (pose.T_WB.p - there->second).norm();
    if (then != in_map.then.end()) point.then = (then->second - there->second).norm();
    if (!in_map.along.empty()) {
      point.at_end = (T_WM * in_map.T_MB(pose).p - there->second).norm();
    }
    errors.points.push_back(point);
  }
  return errors;
}

void drawBodyErrors(cv::Mat& picture, const cv::Rect& area, const BodyErrors& errors,
                    const Chart::Range& frames) {
  const double top = topOf(errors);
  Chart chart(picture, area, frames, {0.0, top});
  for (const BodyErrors::Mark& mark : errors.marks) drawMark(picture, area, chart, mark, top);
  chart.drawGrid(true);
  drawSeries(chart, errors, {kWColour, 2, true, 6.0, 5.0}, [](const auto& p) { return p.in_W; });
  drawSeries(chart, errors, {kEndColour, 2}, [](const auto& p) { return p.at_end; });
  drawSeries(chart, errors, {kThenColour, 2}, [](const auto& p) { return p.then; });
  drawLegend(picture, area, errors);
}

}  // namespace perdure::tools

#include "tools/outputs/pictures/map_picture.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "common/math/so3.h"
#include "tools/base/quantile.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/outputs/pictures/drawing.h"
#include "tools/outputs/pictures/map_legend.h"

namespace perdure::tools {
namespace {

constexpr double kLongSide = 1500.0, kLongestSide = 4000.0;  // pixels
constexpr double kLeastScale = 4.0, kMostScale = 60.0;       // pixels for each metre
constexpr double kNearTheWay = 60.0;                         // metres
constexpr double kLeastExtent = 6.0;

Eigen::Vector2d flat(const Eigen::Vector3d& p) { return p.head<2>(); }

double distanceToWay(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector3d& p) {
  double least = path.empty() ? 0.0 : 1e9;
  for (const auto& q : path) least = std::min(least, (flat(q) - flat(p)).norm());
  return least;
}

/// Three times the distance from the trajectory (m) that includes four fifths of the objects,
/// within limits.
double usualDistance(const MapContent& content) {
  std::vector<double> distances;
  for (const auto& object : content.objects) {
    distances.push_back(distanceToWay(content.path, object.p_W));
  }
  if (distances.empty()) return kNearTheWay;
  return std::clamp(3.0 * sampleAt(std::move(distances), 0.8), kLeastExtent, kNearTheWay);
}

Polyline footprint(const MapView& view, const Eigen::Vector3d& centre, double yaw,
                   const Eigen::Vector3d& size) {
  const Eigen::Matrix2d R = rotationAboutZ(yaw).topLeftCorner<2, 2>();
  Polyline corners;
  for (const auto& [x, y] : {std::pair{.5, .5}, {.5, -.5}, {-.5, -.5}, {-.5, .5}}) {
    corners.push_back(view.at(flat(centre) + R * Eigen::Vector2d(x * size.x(), y * size.y())));
  }
  return corners;
}

int thick(const MapView& view, double width) {
  return std::max(1, static_cast<int>(std::lround(view.text * width)));
}

void drawEllipse(cv::Mat& picture, const MapView& view, const ObjectGlance& object) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(
      Eigen::Matrix2d(object.p_covariance.topLeftCorner<2, 2>()));
  const Eigen::Vector2d axes = 2.0 * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  // Omits ellipses with a half axis above half of the map, which objects out of view can have.
  if (!axes.allFinite() || axes.maxCoeff() > 0.5 * (view.high - view.low).minCoeff()) return;
  Polyline line;
  constexpr int kSteps = 48;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kSteps;
    const Eigen::Vector2d round(axes[0] * std::cos(angle), axes[1] * std::sin(angle));
    line.push_back(view.at(flat(object.p_W) + eigen.eigenvectors() * round));
  }
  drawLine(picture, line, {mixed(classColour(object.class_name), kPaper, 0.35)});
}

void drawObject(cv::Mat& picture, const MapView& view, const ObjectGlance& object) {
  const Colour colour = classColour(object.class_name);
  const Polyline outline = footprint(view, object.p_W, object.yaw, object.size);
  if (!object.hidden()) drawFilled(picture, outline, colour, fillOf(object.visibility));
  drawEllipse(picture, view, object);
  drawClosed(picture, outline,
             {colour, thick(view, object.hidden() ? 1 : 2), object.hidden(), 5.0 * view.text,
              4.0 * view.text});
  const cv::Point2d front = (outline[0] + outline[1]) / 2.0;  // direction that the object faces
  drawLine(picture, {view.at(flat(object.p_W)), front}, {colour, thick(view, 1)});
}

void drawIds(cv::Mat& picture, const MapView& view, const std::vector<ObjectGlance>& objects) {
  const TextStyle style{0.42 * view.text, thick(view, 1)};
  std::vector<cv::Rect> taken;
  for (const ObjectGlance& object : objects) {
    const Polyline outline = footprint(view, object.p_W, object.yaw, object.size);
    const cv::Rect box = cv::boundingRect(std::vector<cv::Point2f>(outline.begin(), outline.end()));
    if ((box & view.area).empty()) continue;
    const std::string text = std::to_string(object.id);
    const cv::Size size = sizeOf(text, style) + cv::Size(4, 4);
    const cv::Rect place = placeFor(size, {box.br().x + 1, box.y - 1}, view.area, taken);
    taken.push_back(place);
    drawText(picture, text, {place.x + 2, place.br().y - 2}, kInk, style);
  }
}

void drawLandmarks(cv::Mat& picture, const MapView& view, const std::vector<Eigen::Vector3f>& all) {
  const Colour colour = kDots;
  for (const Eigen::Vector3f& p : all) {
    const cv::Point at(view.at(p.head<2>().cast<double>()));
    if (!view.area.contains(at)) continue;
    cv::rectangle(picture, cv::Rect(at, cv::Size(thick(view, 2), thick(view, 2))), colour,
                  cv::FILLED);
  }
}

void drawWay(cv::Mat& picture, const MapView& view, const std::vector<Eigen::Vector3d>& path,
             const Stroke& stroke) {
  Polyline line;
  for (const auto& p : path) line.push_back(view.at(flat(p)));
  drawLine(picture, line, stroke);
}

void drawEnds(cv::Mat& picture, const MapView& view, const std::vector<Eigen::Vector3d>& path) {
  if (path.empty()) return;
  cv::circle(picture, cv::Point(view.at(flat(path.front()))), thick(view, 5), kInk, cv::FILLED,
             cv::LINE_AA);
  Eigen::Vector2d way(1, 0);
  for (const auto& p : path) {
    const Eigen::Vector2d d = flat(path.back()) - flat(p);
    if (d.norm() > 0.5) way = d.normalized();
  }
  const cv::Point2d end = view.at(flat(path.back())), along(way.x(), -way.y());
  const cv::Point2d across(-along.y, along.x);
  const double size = 9.0 * view.text;
  drawFilled(picture,
             {end + along * 1.6 * size, end - along * 0.6 * size + across * size,
              end - along * 0.6 * size - across * size},
             kInk, 1.0);
}

void drawAnchors(cv::Mat& picture, const MapView& view, const std::vector<Eigen::Vector3d>& all) {
  for (const Eigen::Vector3d& p : all) {
    cv::circle(picture, cv::Point(view.at(flat(p))), thick(view, 3), kInk, cv::FILLED, cv::LINE_AA);
    cv::circle(picture, cv::Point(view.at(flat(p))), thick(view, 2), kPaper, cv::FILLED,
               cv::LINE_AA);
  }
}

/// Draws rejected loops over accepted ones, so that they are visible.
void drawLoops(cv::Mat& picture, const MapView& view, const std::vector<LoopLine>& loops) {
  for (const bool believed : {true, false}) {
    for (const LoopLine& loop : loops) {
      if (loop.believed != believed) continue;
      drawLine(picture, {view.at(flat(loop.a_M)), view.at(flat(loop.b_M))},
               loopStroke(believed, view.text));
    }
  }
}

void drawTruth(cv::Mat& picture, const MapView& view, const PictureTruth& truth, TimePoint end) {
  std::vector<Eigen::Vector3d> path;
  for (const auto& [frame, p] : truth.path) path.push_back(p);
  drawWay(picture, view, path, {mixed(kTruthColour, kPaper, 0.45), thick(view, 1)});
  const Stroke stroke{kTruthColour, thick(view, 1)};
  for (const TruthTrack& track : truth.objects) {
    if (track.moves) {
      std::vector<Eigen::Vector3d> way;
      for (const auto& key : track.keys) way.push_back(key.centre_W);
      drawWay(picture, view, way, {mixed(kTruthColour, kPaper, 0.45), thick(view, 1)});
      continue;
    }
    const auto key = track.at(end);
    if (!key) continue;
    drawClosed(picture, footprint(view, key->centre_W, key->yaw, track.size), stroke);
    if (track.size.head<2>().minCoeff() * view.scale < 12.0 * view.text) continue;
    const cv::Point2d at = view.at(flat(key->centre_W));
    const cv::Point2d arm(3.0 * view.text, 0), leg(0, 3.0 * view.text);
    drawLine(picture, {at - arm, at + arm}, stroke);
    drawLine(picture, {at - leg, at + leg}, stroke);
  }
}

void drawGrid(cv::Mat& picture, const MapView& view) {
  const TextStyle style{0.42 * view.text, thick(view, 1)};
  const int most = std::max(3, static_cast<int>(view.area.width / (110.0 * view.text)));
  const auto ticks = ticksOf(0.0, (view.high - view.low).maxCoeff(), most);
  const double step = ticks.size() > 1 ? ticks[1] : 1.0;
  for (double x = std::ceil(view.low.x() / step) * step; x <= view.high.x(); x += step) {
    const cv::Point2d p = view.at({x, view.low.y()});
    drawLine(picture, {p, view.at({x, view.high.y()})}, {kGrid});
    const std::string text = numberText(std::round(x / step) * step);
    const cv::Size size = sizeOf(text, style);
    drawText(picture, text, cv::Point(p) + cv::Point(-size.width / 2, size.height + 8), kInk,
             style);
  }
  for (double y = std::ceil(view.low.y() / step) * step; y <= view.high.y(); y += step) {
    const cv::Point2d p = view.at({view.low.x(), y});
    drawLine(picture, {p, view.at({view.high.x(), y})}, {kGrid});
    const std::string text = numberText(std::round(y / step) * step);
    const cv::Size size = sizeOf(text, style);
    drawText(picture, text, cv::Point(p) + cv::Point(-size.width - 8, size.height / 2), kInk,
             style);
  }
  cv::rectangle(picture, view.area, mixed(kInk, kPaper, 0.4), 1);
}

}  // namespace

MapView viewOf(const MapContent& content) {
  Eigen::AlignedBox2d bounds;
  for (const auto& p : content.path) bounds.extend(flat(p));
  const double near = usualDistance(content);
  const auto include = [&](const Eigen::Vector3d& p, double limit) {
    if (distanceToWay(content.path, p) < limit) bounds.extend(flat(p));
  };
  for (const auto& object : content.objects) include(object.p_W, near);
  if (bounds.isEmpty()) bounds.extend(Eigen::Vector2d::Zero());
  if (content.truth) {
    for (const auto& track : content.truth->objects)
      include(track.keys.back().centre_W, 0.5 * near);
  }
  const double room = std::max(3.0, 0.04 * bounds.sizes().maxCoeff());
  const Eigen::Vector2d half =
      (0.5 * bounds.sizes() + Eigen::Vector2d::Constant(room)).cwiseMax(0.5 * kLeastExtent);
  MapView view;
  view.low = bounds.center() - half;
  view.high = bounds.center() + half;
  const double extent = 2.0 * half.maxCoeff();
  view.scale =
      std::min(std::clamp(kLongSide / extent, kLeastScale, kMostScale), kLongestSide / extent);
  view.text = std::max(1.15, view.scale * extent / (1.2 * kLongSide));
  const auto side = [&](double metres) {
    return static_cast<int>(std::lround(view.scale * metres));
  };
  view.area = {static_cast<int>(64 * view.text), static_cast<int>(20 * view.text),
               side(2.0 * half.x()), side(2.0 * half.y())};
  view.bar_m = roundBelow(std::min(0.25 * extent, 0.6 * 2.0 * half.x()));
  view.bar = {view.area.x + static_cast<int>(16 * view.text),
              view.area.br().y - static_cast<int>(16 * view.text)};
  return view;
}

cv::Mat drawMap(const MapContent& content, const MapView& view) {
  cv::Mat picture(pictureSize(content, view), CV_8UC3, kPaper);
  drawGrid(picture, view);
  cv::Mat map = picture.clone();  // a copy, of which only the map's area is used
  drawLandmarks(map, view, content.landmarks);
  drawWay(map, view, content.path, {kInk, thick(view, 2)});
  drawAnchors(map, view, content.anchors);
  drawEnds(map, view, content.path);
  for (const ObjectGlance& object : content.objects) drawObject(map, view, object);
  if (content.truth) drawTruth(map, view, *content.truth, content.end);
  drawLoops(map, view, content.loops);
  drawIds(map, view, content.objects);
  map(view.area).copyTo(picture(view.area));
  drawScaleBar(picture, view);
  drawMapLegend(picture, content, view);
  return picture;
}

bool writeMap(const MapContent& content, const std::filesystem::path& file) {
  if (content.path.empty() && content.objects.empty()) return false;
  writePicture(drawMap(content, viewOf(content)), file);
  return true;
}

}  // namespace perdure::tools

#include "services/gateway/core/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "common/types/cuboid.h"
#include "services/gateway/core/pieces.h"

namespace perdure::gateway {
namespace {

using Point = Eigen::Vector2d;
constexpr int kSamples = 8;  // samples along an edge, which lens distortion bends
enum PointsType { kLineLoop = 2, kLineList = 4 };

/// Adds the visible strokes of the line from a to b, points in C. If `dashed`, adds every second
/// stroke.
void addStrokes(const CameraModel& camera, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                bool dashed, std::vector<Point>& strokes) {
  const int samples = dashed ? 2 * kSamples + 1 : kSamples;
  std::optional<Point> before;
  for (int i = 0; i <= samples; ++i) {
    const auto now = camera.project(a + (b - a) * (static_cast<double>(i) / samples));
    if (before && now && (!dashed || i % 2 == 1)) {
      strokes.push_back(*before);
      strokes.push_back(*now);
    }
    before = now;
  }
}

void putPoint(JsonWriter& json, const Point& p) {
  json.begin('{').with("x", p.x(), 1).with("y", p.y(), 1).end('}');
}

void putLines(JsonWriter& json, TimePoint time, PointsType type, const std::vector<Point>& points,
              const Colour& colour, double thickness, const Colour& fill = {0, 0, 0, 0}) {
  json.begin('{').with("timestamp", time).with("type", static_cast<int>(type)).key("points");
  json.begin('[');
  for (const Point& point : points) putPoint(json, point);
  json.end(']').with("outline_color", colour).key("outline_colors").begin('[').end(']');
  json.with("fill_color", fill).with("thickness", thickness).end('}');
}

struct Label {
  Point at;
  std::string text;
  Colour colour;
};

void putLabel(JsonWriter& json, TimePoint time, const Label& label) {
  json.begin('{').with("timestamp", time).key("position");
  putPoint(json, label.at);
  json.with("text", label.text).with("font_size", 11).with("text_color", Colour{1, 1, 1, 1});
  json.with("background_color", label.colour).end('}');
}

std::vector<Point> projected(const Objects& objects, const ObjectBelief& object,
                             const CameraModel& camera) {
  const RigidTransform T_CW = (objects.T_WB * camera.T_BC()).inverse();
  auto corners = cornersOf(cuboidOf(object, objects.up_W));
  for (Eigen::Vector3d& corner : corners) corner = T_CW * corner;
  std::vector<Point> strokes;
  for (const auto& [a, b] : kEdges) {
    addStrokes(camera, corners[a], corners[b], isHidden(object), strokes);
  }
  addStrokes(camera, (corners[0] + corners[3]) / 2, (corners[1] + corners[3]) / 2, isHidden(object),
             strokes);
  return strokes;
}

/// Draws an object's cuboid. Returns its label if the cuboid is in the image.
std::optional<Label> putObject(JsonWriter& json, const Objects& objects, const ObjectBelief& object,
                               const CameraModel& camera) {
  const std::vector<Point> strokes = projected(objects, object, camera);
  if (strokes.empty()) return std::nullopt;
  const Colour colour = classColour(object.best().name);
  putLines(json, objects.stamp.time, kLineList, strokes,
           colour.withAlpha(isHidden(object) ? 0.8 : std::max(0.3, object.existence)), 2);
  Point corner = strokes.front();
  for (const Point& p : strokes) corner = corner.cwiseMin(p);
  if (corner.x() > camera.width() || corner.y() > camera.height()) return std::nullopt;
  corner = corner.cwiseMax(Point(2, 14));
  const std::string hidden = isHidden(object) ? " hidden" : "";
  return Label{corner, nameOf(object) + hidden, colour.withAlpha(isHidden(object) ? 0.45 : 0.75)};
}

/// Returns the probability that the box is of its most probable class rather than clutter, given
/// even prior odds.
double likelihood(const Detection& detection) {
  if (detection.activations.size() < 2) return 0.0;
  const float best =
      *std::max_element(detection.activations.begin() + 1, detection.activations.end());
  return 1.0 / (1.0 + std::exp(static_cast<double>(detection.activations[0] - best)));
}

void putDetection(JsonWriter& json, TimePoint time, const Detection& detection) {
  const double bright = likelihood(detection);
  constexpr double kDarkest = 0.05;
  if (bright < kDarkest || detection.primed) return;
  const Box& b = detection.box;
  putLines(json, time, kLineLoop, {{b.x1, b.y1}, {b.x2, b.y1}, {b.x2, b.y2}, {b.x1, b.y2}},
           {1, 1, 1, bright}, 1);
}

/// Returns the convex hull of the points by Andrew's monotone chain algorithm.
std::vector<Point> convexHull(std::vector<Point> points) {
  std::ranges::sort(points, [](const Point& a, const Point& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Point> hull;
  const auto extend = [&hull](const Point& p, std::size_t keep) {
    const auto turns = [&](const Point& a, const Point& b) {
      return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x()) > 0;
    };
    while (hull.size() > keep && !turns(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(p);
  };
  for (const Point& p : points) extend(p, 1);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin(); p != points.rend(); ++p) extend(*p, lower);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

Box boundsOf(const std::vector<Point>& points, const CameraModel& camera) {
  Point low = points.front(), high = points.front();
  for (const Point& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Point size(camera.width(), camera.height());
  low = low.cwiseMax(Point::Zero()).cwiseMin(size);
  high = high.cwiseMax(Point::Zero()).cwiseMin(size);
  return {low.x(), low.y(), high.x(), high.y()};
}

struct Said {
  double likelihood = 0.0;
  /// True if the likelihood comes from an answer to a prediction, not from a reported box.
  bool asked = false;
};

/// Returns the probability of the object's class against clutter, given even prior odds, for the
/// detection in `region` or for the answer to the object's prediction; nothing if there is neither.
std::optional<Said> saidOf(const ObjectBelief& object, const Box& region,
                           const Detections& detections, const ModelInfo& model) {
  constexpr double kLeastOverlap = 0.3;
  const auto name = std::ranges::find(model.classes, object.best().name);
  const auto k = static_cast<std::size_t>(name - model.classes.begin()) + 1;
  const Detection* of = nullptr;
  double best = kLeastOverlap;
  for (const Detection& one : detections.detections) {
    if (k >= one.activations.size()) continue;  // the network does not have this class
    const double overlap = one.primed ? (one.primed_for == object.id ? best : 0.0)
                                      : intersectionOverUnion(one.box, region);
    if (overlap >= best) of = &one, best = overlap;
  }
  if (of == nullptr) return std::nullopt;
  const double nats = of->activations[k] - of->activations[0];
  return Said{1.0 / (1.0 + std::exp(-nats)), of->primed};
}

struct Region {
  std::vector<Point> outline;
  double distance = 0.0;
  Colour colour;
  double brightness = 0.0;
  Label label;
};

std::optional<Region> regionOf(const Objects& objects, const ObjectBelief& object,
                               const CameraModel& camera, const Detections* detections,
                               const ModelInfo* model) {
  const std::vector<Point> strokes = projected(objects, object, camera);
  if (strokes.size() < 3) return std::nullopt;
  const Box bounds = boundsOf(strokes, camera);
  if (bounds.width() <= 0 || bounds.height() <= 0) return std::nullopt;
  const auto said = detections != nullptr && model != nullptr
                        ? saidOf(object, bounds, *detections, *model)
                        : std::nullopt;
  Region region;
  region.outline = convexHull(strokes);
  region.distance = (object.best().mean.head<3>() - objects.T_WB.p).norm();
  region.colour = classColour(object.best().name);
  region.brightness = said ? said->likelihood : 0.0;
  const std::string value =
      said ? fmt::format("{:.2f}{}", said->likelihood, said->asked ? " top-down" : "")
           : "nothing said";
  region.label = {Point(std::max(2.0, bounds.x1), std::max(14.0, bounds.y1)),
                  nameOf(object) + " " + value, region.colour.withAlpha(0.75)};
  return region;
}

}  // namespace

std::string likelihoodRegions(const Objects& objects, const CameraModel& camera,
                              const Detections* detections, const ModelInfo* model) {
  std::vector<Region> regions;
  for (const ObjectBelief& object : objects.objects) {
    if (!object.confirmed || !isInSight(object)) continue;
    if (auto region = regionOf(objects, object, camera, detections, model))
      regions.push_back(*std::move(region));
  }
  // Nearer regions are drawn over farther ones.
  std::ranges::sort(regions, std::greater{}, &Region::distance);
  JsonWriter json(1024 + 2048 * regions.size());
  json.begin('{').with("timestamp", objects.stamp.time).key("circles").begin('[').end(']');
  json.key("points").begin('[');
  for (const Region& region : regions) {
    const double b = region.brightness;
    putLines(json, objects.stamp.time, kLineLoop, region.outline, region.colour.withAlpha(0.9), 1.5,
             {b, b, b, 0.85});
  }
  json.end(']').key("texts").begin('[');
  for (const Region& region : regions) putLabel(json, objects.stamp.time, region.label);
  return json.end(']').end('}').take();
}

std::string imageAnnotations(const Objects& objects, const CameraModel& camera,
                             const Detections* detections) {
  JsonWriter json(1024 + 3072 * objects.objects.size());
  json.begin('{').with("timestamp", objects.stamp.time).key("circles").begin('[').end(']');
  json.key("points").begin('[');
  if (detections != nullptr) {
    for (const Detection& one : detections->detections) putDetection(json, objects.stamp.time, one);
  }
  std::vector<Label> labels;
  for (const ObjectBelief& object : objects.objects) {
    if (!object.confirmed || !(isInSight(object) || isHidden(object))) continue;
    if (auto label = putObject(json, objects, object, camera)) labels.push_back(*label);
  }
  json.end(']').key("texts").begin('[');
  for (const Label& label : labels) putLabel(json, objects.stamp.time, label);
  return json.end(']').end('}').take();
}

}  // namespace perdure::gateway

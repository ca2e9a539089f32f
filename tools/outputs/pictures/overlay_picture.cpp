#include "tools/outputs/pictures/overlay_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/math/so3.h"
#include "common/types/cuboid.h"
#include "tools/base/quantile.h"
#include "tools/outputs/pictures/drawing.h"

namespace perdure::tools {
namespace {

constexpr int kHeader = 30;
constexpr double kDimmed = 0.88;            // factor that dims the image, to make lines visible
constexpr double kLeastProbability = 0.15;  // less probable boxes are not drawn
constexpr int kSamples = 16;                // points of an edge, because lenses bend edges
const Colour kWhite(255, 255, 255), kGrey(165, 165, 165), kNight(38, 34, 30);

int even(double value) { return static_cast<int>(value) / 2 * 2; }

Colour brightColour(const ObjectGlance& object) {
  return mixed(classColour(object.class_name), kWhite, 0.35);
}

/// Removes the inner points of `line` if it is straight.
void straighten(Polyline& line) {
  if (line.size() < 3) return;
  const cv::Point2d way = line.back() - line.front();
  const double length = std::max(1e-9, cv::norm(way));
  const bool straight = std::ranges::all_of(line, [&](const cv::Point2d& p) {
    return std::abs(way.cross(p - line.front())) < 0.3 * length;
  });
  if (straight) line = {line.front(), line.back()};
}

/// Projects the line from a to b (in C) into the image; invisible parts divide it into pieces.
std::vector<Polyline> projected(const CameraModel& camera, const Eigen::Vector3d& a,
                                const Eigen::Vector3d& b, double scale) {
  std::vector<Polyline> pieces(1);
  for (int i = 0; i <= kSamples; ++i) {
    const auto pixel = camera.project(a + (b - a) * (static_cast<double>(i) / kSamples));
    if (pixel)
      pieces.back().emplace_back(scale * (pixel->x() + 0.5) - 0.5,
                                 scale * (pixel->y() + 0.5) - 0.5);
    else if (!pieces.back().empty())
      pieces.emplace_back();
  }
  for (Polyline& one : pieces) straighten(one);
  return pieces;
}

/// Draws an object's cuboid. Returns the area that it covers, empty if it is outside the image.
cv::Rect drawBox(cv::Mat& image, const ObjectGlance& object, const RigidTransform& T_CW,
                 const CameraModel& camera, double scale) {
  const auto corners_W = cornersOf(object);
  std::array<Eigen::Vector3d, 8> corners;
  std::ranges::transform(corners_W, corners.begin(),
                         [&](const Eigen::Vector3d& p) { return T_CW * p; });
  const Stroke stroke{brightColour(object), 2, object.hidden(), 8.0, 7.0};
  const cv::Rect all({}, image.size());
  std::vector<cv::Point> covered;
  const auto draw = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    for (const Polyline& line : projected(camera, a, b, scale)) {
      drawLine(image, line, stroke);
      for (std::size_t i = 1; i < line.size(); ++i) {
        cv::Point2d from = line[i - 1], to = line[i];
        if (!clip(cv::Rect2d(all), from, to)) continue;
        covered.emplace_back(from);
        covered.emplace_back(to);
      }
    }
  };
  for (const auto& [a, b] : kEdges) draw(corners[a], corners[b]);
  // The object's direction: from the centre of its underside to the middle of the lower front edge.
  draw((corners[0] + corners[3]) / 2.0, (corners[1] + corners[3]) / 2.0);
  return covered.empty() ? cv::Rect() : cv::boundingRect(covered) & all;
}

std::string labelOf(const ObjectGlance& object) {
  return fmt::format("{} {}  {:.2f}{}{}", object.class_name, object.id, object.existence,
                     object.hidden() ? " hidden" : "", object.moving >= 0.5 ? " moves" : "");
}

void drawLabel(cv::Mat& image, const ObjectGlance& object, const cv::Rect& box,
               std::vector<cv::Rect>& taken) {
  const TextStyle style{0.42};
  const std::string text = labelOf(object);
  const cv::Size size = sizeOf(text, style) + cv::Size(8, 7);
  const cv::Rect place = placeFor(size, {box.x, box.y - 2}, {{}, image.size()}, taken);
  taken.push_back(place);
  tint(image, place, object.hidden() ? kNight : classColour(object.class_name) * 0.7, 0.78);
  drawText(image, text, {place.x + 4, place.br().y - 4}, kWhite, style);
}

std::vector<ObjectGlance> fartherFirst(const FrameGlance& frame) {
  std::vector<ObjectGlance> objects;
  std::ranges::copy_if(frame.objects, std::back_inserter(objects),
                       [](const auto& o) { return o.confirmed && (o.inSight() || o.hidden()); });
  std::ranges::stable_sort(objects, [&](const auto& a, const auto& b) {
    return (a.p_W - frame.T_WB.p).squaredNorm() > (b.p_W - frame.T_WB.p).squaredNorm();
  });
  return objects;
}

void drawDetections(cv::Mat& image, const FrameGlance& frame, double scale) {
  for (const DetectionGlance& one : frame.detections) {
    if (one.probability < kLeastProbability) continue;
    const cv::Rect2d box(scale * one.box.x1, scale * one.box.y1, scale * one.box.width(),
                         scale * one.box.height());
    cv::rectangle(image, cv::Rect(box), kGrey, 1);
  }
}

void drawHeader(cv::Mat& header, const FrameGlance& frame, TimePoint start) {
  const auto known = [&](auto which) {
    return std::ranges::count_if(frame.objects,
                                 [&](const auto& o) { return o.confirmed && which(o); });
  };
  header.setTo(kNight);
  const TextStyle style{0.5};
  const std::string text =
      fmt::format("frame {}   {:.1f} s   {} objects: {} in sight, {} hidden", frame.stamp.sequence,
                  toSeconds(frame.stamp.time - start), known([](const auto&) { return true; }),
                  known([](const auto& o) { return o.inSight(); }),
                  known([](const auto& o) { return o.hidden(); }));
  drawText(header, text, {10, 20}, kWhite, style);
  const std::string key = "solid: in sight   dashed: known, hidden   grey: detector";
  const cv::Point right(header.cols - sizeOf(key, {0.42}).width - 10, 20);
  if (right.x > sizeOf(text, style).width + 30) drawText(header, key, right, kGrey, {0.42});
}

// Transforms metres ahead and to the left of the body to pixels of the top view.
struct PlanView {
  cv::Point2d body;
  double scale;
  RigidTransform T_WB;
  Eigen::Matrix3d R_HW;  ///< rotates W to the body's heading

  cv::Point2d operator()(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d p = R_HW * (p_W - T_WB.p);
    return ahead(p.x(), p.y());
  }
  cv::Point2d ahead(double x, double y) const { return {body.x - scale * y, body.y - scale * x}; }
};

void drawRings(cv::Mat& plan, const PlanView& view, double reach) {
  const double nice[] = {1, 2, 5, 10, 20, 50};
  const double step = *std::find_if(std::begin(nice), std::end(nice) - 1,
                                    [&](double s) { return s >= reach / 4.0; });
  for (double r = step; r <= reach; r += step) {
    const int radius = static_cast<int>(std::lround(view.scale * r));
    cv::circle(plan, cv::Point(view.body), radius, kGrid, 1, cv::LINE_AA);
    drawText(plan, fmt::format("{:g} m", r), cv::Point(view.ahead(r, 0)) + cv::Point(3, 11),
             mixed(kInk, kPaper, 0.4), {0.34});
  }
}

void drawFieldOfView(cv::Mat& plan, const PlanView& view, const CameraModel& camera, double far) {
  for (const double x : {0.0, camera.width() - 1.0}) {
    const auto ray = camera.unproject({x, camera.cy()});
    if (!ray) continue;
    const Eigen::Vector3d way_B =
        camera.T_BC().q * Eigen::Vector3d(ray->x(), ray->y(), 1.0).normalized();
    const Eigen::Vector3d way = view.R_HW * (view.T_WB.q * way_B);
    drawLine(plan, {view.body, view.ahead(far * way.x(), far * way.y())},
             {mixed(kInk, kPaper, 0.75)});
  }
}

}  // namespace

OverlayPicture::OverlayPicture(const CameraCalibration& camera, const OverlaySettings& settings)
    : camera_(camera),
      settings_(settings),
      scale_(std::min(1.0, settings.max_width / static_cast<double>(camera.width))) {}

cv::Rect OverlayPicture::imageArea() const {
  return {0, kHeader, std::max(2, even(scale_ * camera_.width())),
          std::max(2, even(scale_ * camera_.height()))};
}

cv::Size OverlayPicture::size() const {
  const cv::Rect image = imageArea();
  return {image.width + even(0.7 * image.height), image.height + kHeader};
}

cv::Mat OverlayPicture::draw(const cv::Mat& image, const FrameGlance& frame,
                             const std::vector<Eigen::Vector3d>& path, TimePoint start) const {
  cv::Mat picture(size(), CV_8UC3);
  const cv::Rect area = imageArea();
  cv::Mat header = picture.rowRange(0, kHeader), view = picture(area);
  cv::Mat plan = picture(cv::Rect(area.br().x, kHeader, picture.cols - area.width, area.height));
  drawHeader(header, frame, start);
  drawImage(image, view);
  drawDetections(view, frame, scale_);
  if (frame.has_objects) drawObjects(view, frame);
  drawPlan(plan, frame, path);
  return picture;
}

void OverlayPicture::drawImage(const cv::Mat& from, cv::Mat& to) const {
  cv::Mat sized = from;
  if (scale_ < 1.0) cv::resize(from, sized, {}, scale_, scale_, cv::INTER_AREA);
  cv::Mat colour = sized;
  if (sized.channels() == 1) cv::cvtColor(sized, colour, cv::COLOR_GRAY2BGR);
  colour(cv::Rect({}, to.size())).convertTo(to, -1, kDimmed);
}

void OverlayPicture::drawObjects(cv::Mat& image, const FrameGlance& frame) const {
  const CameraModel& camera = frame.camera ? *frame.camera : camera_;
  const RigidTransform T_CW = (frame.T_WB * camera.T_BC()).inverse();
  const auto objects = fartherFirst(frame);
  std::vector<cv::Rect> boxes(objects.size()), taken;
  for (const bool hidden : {false, true}) {  // draws occluded objects last
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].hidden() != hidden) continue;
      boxes[i] = drawBox(image, objects[i], T_CW, camera, scale_);
    }
  }
  for (std::size_t i = objects.size(); i-- > 0;) {  // places labels of near objects first
    if (!boxes[i].empty()) drawLabel(image, objects[i], boxes[i], taken);
  }
}

void OverlayPicture::drawPlan(cv::Mat& plan, const FrameGlance& frame,
                              const std::vector<Eigen::Vector3d>& path) const {
  plan.setTo(kPaper);
  if (!frame.has_objects) return;
  const PlanView view{{0.5 * plan.cols, 0.82 * plan.rows},
                      0.8 * plan.rows / settings_.reach_m,
                      frame.T_WB,
                      rotationAboutZ(-yawOf(frame.T_WB.R()))};
  drawRings(plan, view, settings_.reach_m);
  drawFieldOfView(plan, view, camera_, 2.0 * settings_.reach_m);
  Polyline way;
  for (const auto& p : path) way.push_back(view(p));
  drawLine(plan, way, {mixed(kInk, kPaper, 0.3), 2});
  for (const ObjectGlance& object : frame.objects) {
    if (!object.confirmed) continue;
    const auto corners = cornersOf(object);
    const Polyline outline = {view(corners[0]), view(corners[1]), view(corners[3]),
                              view(corners[2])};
    const Colour colour = classColour(object.class_name);
    if (object.inSight()) drawFilled(plan, outline, colour, 0.45);
    drawClosed(plan, outline, {colour, object.inSight() ? 2 : 1, object.hidden(), 3.0, 3.0});
  }
  drawFilled(plan,
             {view.body + cv::Point2d(0, -9), view.body + cv::Point2d(5, 6),
              view.body + cv::Point2d(-5, 6)},
             kInk, 1.0);
}

double usualReach(const DriveLog& log) {
  std::vector<double> distances;
  for (const auto& [index, frame] : log.frames()) {
    for (const auto& object : frame.objects) {
      if (!object.confirmed || !object.inSight()) continue;
      distances.push_back((object.p_W - frame.T_WB.p).head<2>().norm());
    }
  }
  if (distances.empty()) return 30.0;
  return std::clamp(1.15 * sampleAt(std::move(distances), 0.9), 4.0, 60.0);
}

}  // namespace perdure::tools

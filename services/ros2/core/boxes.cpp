#include "services/ros2/core/boxes.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <optional>

namespace perdure::ros2 {
namespace {

constexpr std::size_t kFramesKept = 64;
constexpr Duration kTolerance = std::chrono::milliseconds(1);

std::string lowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::optional<std::size_t> classOf(const std::string& id, const std::vector<std::string>& classes) {
  const auto named = std::ranges::find(classes, lowerCase(id));
  if (named != classes.end()) return static_cast<std::size_t>(named - classes.begin());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), number);
  if (error != std::errc() || end != id.data() + id.size() || number >= classes.size())
    return std::nullopt;
  return number;
}

std::optional<Box> boxOf(const ros::BoundingBox2D& bbox) {
  const double x = bbox.center.position.x, y = bbox.center.position.y;
  const double w = bbox.size_x, h = bbox.size_y;
  constexpr double kMost = 1e5;  // px
  const bool fine = std::abs(x) < kMost && std::abs(y) < kMost && w > 0.0 && h > 0.0 && w < kMost &&
                    h < kMost;  // false for NaN
  if (!fine || !(std::abs(bbox.center.theta) < 1e-3)) return std::nullopt;
  return Box{x - w / 2, y - h / 2, x + w / 2, y + h / 2};
}

}  // namespace

void FrameBook::add(TimePoint ros_stamp, const FrameStamp& stamp) {
  frames_.push_back({ros_stamp, stamp});
  if (frames_.size() > kFramesKept) frames_.pop_front();
}

const FrameStamp* FrameBook::find(TimePoint ros_stamp) const {
  const Entry* nearest = nullptr;
  for (const Entry& entry : frames_) {
    const Duration off = std::chrono::abs(entry.ros_stamp - ros_stamp);
    if (off > kTolerance) continue;
    if (nearest == nullptr || off <= std::chrono::abs(nearest->ros_stamp - ros_stamp))
      nearest = &entry;
  }
  return nearest == nullptr ? nullptr : &nearest->stamp;
}

bool FrameBook::isAfterAll(TimePoint ros_stamp) const {
  return frames_.empty() || ros_stamp > frames_.back().ros_stamp + kTolerance;
}

std::vector<float> activationsOf(const std::vector<std::pair<std::size_t, double>>& named,
                                 std::size_t classes, double other_share) {
  constexpr double kLeast = 1e-4;
  std::vector<double> p(classes + 1, 0.0);
  double sum = 0.0;
  for (const auto& [k, score] : named) p[k + 1] = std::max(p[k + 1], score);
  for (const double one : p) sum += one;
  const auto unnamed = static_cast<double>(std::count(p.begin() + 1, p.end(), 0.0));
  if (sum >= 1.0 - kLeast) {
    // The scores are independent, or one class is certain: each class is compared with its
    // complement.
    std::vector<float> ratios(classes + 1, 0.0F);
    for (std::size_t k = 1; k <= classes; ++k) {
      const double one = std::clamp(p[k], kLeast, 1.0 - kLeast);
      ratios[k] = static_cast<float>(std::log(one / (1.0 - one)));
    }
    return ratios;
  }
  const double rest = 1.0 - sum, others = unnamed > 0 ? rest * other_share : 0.0;
  for (double& one : p)
    if (one == 0.0) one = unnamed > 0 ? others / unnamed : 0.0;
  p[0] = rest - others;
  std::vector<float> logs;
  for (const double one : p)
    logs.push_back(static_cast<float>(std::log(std::max(one, kLeast / 10))));
  return logs;
}

BoxesRead boxesOf(const ros::Detection2DArray& message, const std::vector<std::string>& classes,
                  double other_share) {
  BoxesRead read;
  const auto refuse = [&](const char* code, const std::string& sentence) {
    read.refused.push_back({code, sentence});
  };
  for (const ros::Detection2D& one : message.detections) {
    const auto box = boxOf(one.bbox);
    if (!box) {
      refuse("box_malformed",
             "a box has no size, is turned, or has values that are not finite; the "
             "detector has to give pixels, upright");
      continue;
    }
    std::vector<std::pair<std::size_t, double>> named;
    for (const auto& result : one.results) {
      const auto& [id, score] = result.hypothesis;
      const auto k = classOf(id, classes);
      if (!k) {
        refuse("class_unknown", "a box is of the class \"" + id.substr(0, 64) +
                                    "\", which in.detections.classes does not list");
      } else if (!(score > 0.0 && score <= 1.0)) {
        refuse("score_malformed",
               "a score is not in 0 … 1; the detector has to give "
               "probabilities");
      } else {
        named.emplace_back(*k, score);
      }
    }
    if (named.empty()) continue;
    Detection detection;
    detection.box = *box;
    detection.activations = activationsOf(named, classes.size(), other_share);
    read.detections.push_back(std::move(detection));
  }
  return read;
}

}  // namespace perdure::ros2

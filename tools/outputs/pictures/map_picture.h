// map.png: the map from above, as figures 1 and 4 of the paper: the way, the sparse points, the
// objects with their uncertainty, and, where it is known, the truth in a colour of its own.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "tools/outputs/frames/drive_in_map.h"
#include "tools/outputs/pictures/drive_log.h"
#include "tools/outputs/pictures/picture_truth.h"

namespace perdure::tools {

/// All of it in one frame, M or W.
struct MapContent {
  bool in_M = false;                  ///< else in W
  std::vector<Eigen::Vector3d> path;  ///< of the body
  std::vector<ObjectGlance> objects;  ///< as they are at the end
  std::vector<Eigen::Vector3f> landmarks;
  std::vector<Eigen::Vector3d> anchors;
  std::vector<LoopLine> loops;
  std::optional<PictureTruth> truth;
  TimePoint end;                       ///< for the truth of what is moved or taken away
  std::optional<double> yaw_of_north;  ///< radians from x
};

/// Metres to the picture's pixels: x to the right, y up, the same scale both ways.
struct MapView {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Ones();  ///< metres
  double scale = 1.0;  ///< pixels a metre
  double text = 1.0;   ///< size of letters and lines; larger pictures need larger ones
  cv::Rect area;       ///< of the map in the picture
  double bar_m = 1.0;  ///< length of the scale bar
  cv::Point bar;       ///< its left end

  cv::Point2d at(const Eigen::Vector2d& p) const {
    return {area.x + scale * (p.x() - low.x()), area.y + scale * (high.y() - p.y())};
  }
};

/// A view of the way and of what is near it (60 m, less in rooms; truth: half of that).
MapView viewOf(const MapContent& content);
cv::Mat drawMap(const MapContent& content, const MapView& view);
/// False: there is neither a way nor an object, or the file cannot be written.
bool writeMap(const MapContent& content, const std::filesystem::path& file);

}  // namespace perdure::tools

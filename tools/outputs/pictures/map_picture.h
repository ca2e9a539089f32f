// map.png, like figures 1 and 4 of the paper: trajectory, sparse points, objects with uncertainty,
// and ground truth.
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

/// The content of the map. All of it is in one frame, M or W.
struct MapContent {
  bool in_M = false;                  ///< false: the content is in W
  std::vector<Eigen::Vector3d> path;  ///< trajectory of the body
  std::vector<ObjectGlance> objects;  ///< estimates at the end
  std::vector<Eigen::Vector3f> landmarks;
  std::vector<Eigen::Vector3d> anchors;
  std::vector<LoopLine> loops;
  std::optional<PictureTruth> truth;
  TimePoint end;                       ///< time for ground truth of objects that move or disappear
  std::optional<double> yaw_of_north;  ///< radians from x
};

/// Transforms metres to pixels of the picture: x to the right, y up, equal scales.
struct MapView {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Ones();  ///< metres
  double scale = 1.0;  ///< pixels for each metre
  double text = 1.0;   ///< factor for the sizes of letters and lines
  cv::Rect area;       ///< area of the map in the picture
  double bar_m = 1.0;  ///< length of the scale bar
  cv::Point bar;       ///< left end of the scale bar

  cv::Point2d at(const Eigen::Vector2d& p) const {
    return {area.x + scale * (p.x() - low.x()), area.y + scale * (high.y() - p.y())};
  }
};

/// Returns a view of the trajectory and all objects up to 60 m from it (less in rooms). Ground
/// truth is included up to half of that distance.
MapView viewOf(const MapContent& content);
cv::Mat drawMap(const MapContent& content, const MapView& view);
/// Draws and writes the map. Returns false if there is neither a trajectory nor an object. Throws
/// StartupError(kInputOutput) if the file cannot be written.
bool writeMap(const MapContent& content, const std::filesystem::path& file);

}  // namespace perdure::tools

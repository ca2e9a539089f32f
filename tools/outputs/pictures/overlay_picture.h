// One frame of overlay.mp4: the image with cuboids (dashed if occluded), and a top view.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "tools/outputs/pictures/drive_log.h"

namespace perdure::tools {

struct OverlaySettings {
  double reach_m = 30.0;  ///< distance from the body to the upper edge of the top view
  int max_width = 1280;   ///< larger images are scaled down to this width
};

class OverlayPicture {
 public:
  OverlayPicture(const CameraCalibration& camera, const OverlaySettings& settings);

  /// Size of each picture, with the scaled image, the top view and the header; even numbers.
  cv::Size size() const;
  cv::Rect imageArea() const;
  /// Draws a picture. `image`: CV_8UC1 or CV_8UC3 in the size of the calibration, not undistorted.
  /// `path`: positions of the body up to this frame. `start`: the time that is displayed as 0.
  cv::Mat draw(const cv::Mat& image, const FrameGlance& frame,
               const std::vector<Eigen::Vector3d>& path, TimePoint start) const;

 private:
  void drawImage(const cv::Mat& from, cv::Mat& to) const;
  void drawObjects(cv::Mat& image, const FrameGlance& frame) const;
  void drawPlan(cv::Mat& plan, const FrameGlance& frame,
                const std::vector<Eigen::Vector3d>& path) const;

  CameraModel camera_;
  OverlaySettings settings_;
  double scale_;  ///< scale of the image in the picture
};

/// Range of the top view in m: 1.15 times the distance from the body that includes nine tenths of
/// the confirmed objects in sight; at least 4, at most 60. Returns 30 if there were no objects.
double usualReach(const DriveLog& log);

}  // namespace perdure::tools

// One frame of overlay.mp4: the image with the objects as boxes in space, solid where they are in
// sight, dashed where they are known and hidden, and beside it what is around the body from above.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "tools/outputs/pictures/drive_log.h"

namespace perdure::tools {

struct OverlaySettings {
  double reach_m = 30.0;  ///< from the body to the upper edge of the plan
  int max_width = 1280;   ///< larger images are made smaller, to this
};

class OverlayPicture {
 public:
  OverlayPicture(const CameraCalibration& camera, const OverlaySettings& settings);

  /// Of every picture: that of the image (after scaling), the plan and the header; even numbers.
  cv::Size size() const;
  /// Where the image is in the picture.
  cv::Rect imageArea() const;
  /// `image`: CV_8UC1 or CV_8UC3 in the size of the calibration, distorted as it is. `path`: where
  /// the body was, up to this frame. `start`: the time that counts as 0.
  cv::Mat draw(const cv::Mat& image, const FrameGlance& frame,
               const std::vector<Eigen::Vector3d>& path, TimePoint start) const;

 private:
  void drawImage(const cv::Mat& from, cv::Mat& to) const;
  void drawObjects(cv::Mat& image, const FrameGlance& frame) const;
  void drawPlan(cv::Mat& plan, const FrameGlance& frame,
                const std::vector<Eigen::Vector3d>& path) const;

  CameraModel camera_;
  OverlaySettings settings_;
  double scale_;  ///< of the image in the picture
};

/// Metres from the body within which nine tenths of the confirmed objects in sight were: what a
/// plan should show. 30 where there were none; at least 4, at most 60.
double usualReach(const DriveLog& log);

}  // namespace perdure::tools

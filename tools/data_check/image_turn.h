// Estimates the rotation of a camera between two images, independently of its translation.
// Translation moves a point along its epipolar line, so the flow across this line depends on the
// rotation only.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"

namespace perdure::tools {

struct Flow {
  Eigen::Vector3d ray, step;  ///< unit ray in C, and its change
};

/// An image and its pyramid for tracking; empty if there is no image.
struct FollowedImage {
  cv::Mat image;
  std::vector<cv::Mat> pyramid;

  FollowedImage() = default;
  explicit FollowedImage(const cv::Mat& grey);
  bool empty() const { return image.empty(); }
};

/// Corners of an image, well distributed.
std::vector<cv::Point2f> cornersOf(const FollowedImage& image);
/// Returns the position in the second image of each point of the first, or nothing if tracking
/// fails.
std::vector<std::optional<cv::Point2f>> follow(const FollowedImage& first,
                                               const FollowedImage& second,
                                               const std::vector<cv::Point2f>& from);

/// Flow of the corners that can be tracked; empty if there are too few of them.
std::vector<Flow> flowBetween(const CameraModel& camera, const FollowedImage& first,
                              const FollowedImage& second);

/// The small rotation of the camera, rad in C. Translation is estimated only if it clearly improves
/// the fit; otherwise the whole flow determines the rotation.
Eigen::Vector3d rotationOf(const std::vector<Flow>& flow);

}  // namespace perdure::tools

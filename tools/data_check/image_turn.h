// Estimates the rotation of a camera between two images independent of its translation. Translation
// moves a point along its epipolar line, so that only the flow across the line depends on the
// rotation.
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

/// An image with the pyramid for tracking; empty without an image.
struct FollowedImage {
  cv::Mat image;
  std::vector<cv::Mat> pyramid;

  FollowedImage() = default;
  explicit FollowedImage(const cv::Mat& grey);
  bool empty() const { return image.empty(); }
};

/// Corners of an image, well distributed.
std::vector<cv::Point2f> cornersOf(const FollowedImage& image);
/// Where each point of the first image is in the second; nothing if it cannot be tracked.
std::vector<std::optional<cv::Point2f>> follow(const FollowedImage& first,
                                               const FollowedImage& second,
                                               const std::vector<cv::Point2f>& from);

/// Flow of the corners that can be tracked; empty if they are too few.
std::vector<Flow> flowBetween(const CameraModel& camera, const FollowedImage& first,
                              const FollowedImage& second);

/// The small rotation of the camera, rad in C. Translation is only estimated if the flow shows one.
/// If all points are far, the flow along the lines also depends on the rotation.
Eigen::Vector3d rotationOf(const std::vector<Flow>& flow);

}  // namespace perdure::tools

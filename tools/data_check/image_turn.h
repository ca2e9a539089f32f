// How a camera turned between two images, its own way apart: what a way adds to the flow of a point
// lies along the point's epipolar line, so that only the flow across it tells of the turn.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "common/camera/camera_model.h"

namespace perdure::tools {

struct Flow {
  Eigen::Vector3d ray, step;  ///< unit, in C; and by how much it moved
};

/// An image with what is needed to follow its corners; empty without one.
struct FollowedImage {
  cv::Mat image;
  std::vector<cv::Mat> pyramid;

  FollowedImage() = default;
  explicit FollowedImage(const cv::Mat& grey);
  bool empty() const { return image.empty(); }
};

/// Of corners that can be followed; empty where there are too few.
std::vector<Flow> flowBetween(const CameraModel& camera, const FollowedImage& first,
                              const FollowedImage& second);

/// The small rotation of the camera, rad in C. The way is left out only where the flow shows one:
/// where all is far, the flow along the lines tells of the turn, too.
Eigen::Vector3d rotationOf(const std::vector<Flow>& flow);

}  // namespace perdure::tools

// 256-bit upright BRIEF descriptor (Calonder et al., ECCV 2010), smoothed by a 5×5 box.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/types/odometry.h"

namespace perdure::vio {

using Descriptor = std::array<std::uint8_t, 32>;

/// Takes a CV_8UC1 image. Empty if the pixel is nearer than 16 pixels to the border.
std::optional<Descriptor> descriptorAt(const cv::Mat& image, const Eigen::Vector2d& pixel);

/// Landmarks of an image (CV_8UC1) of `camera`, with descriptors, without non-finite ones.
Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image);

}  // namespace perdure::vio

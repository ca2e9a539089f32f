// Upright BRIEF descriptor of 256 bits (Calonder et al., ECCV 2010), of an image that a 5×5 box
// smooths.
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

/// Returns the descriptor of a pixel of a CV_8UC1 image; nothing if the pixel is less than 16
/// pixels from the border.
std::optional<Descriptor> descriptorAt(const cv::Mat& image, const Eigen::Vector2d& pixel);

/// Returns the message with the landmarks of an image (CV_8UC1) of `camera`, with descriptors.
/// Landmarks with non-finite numbers are left out.
Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image);

}  // namespace perdure::vio

// 256-bit BRIEF of a patch (Calonder et al., ECCV 2010): the attribute that lets a landmark be
// found again. Upright, smoothed by a 5×5 box, with a fixed pattern of our own.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

namespace perdure::vio {

using Descriptor = std::array<std::uint8_t, 32>;

/// Of a CV_8UC1 image. Nothing nearer than 16 pixels to the border.
std::optional<Descriptor> descriptorAt(const cv::Mat& image, const Eigen::Vector2d& pixel);

}  // namespace perdure::vio

// Makes the published message of landmarks.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/types/odometry.h"

namespace perdure::vio {

/// Landmarks of an image (CV_8UC1) of `camera`, with descriptors, without non-finite ones.
Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image);

}  // namespace perdure::vio

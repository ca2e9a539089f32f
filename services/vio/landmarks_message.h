// Makes the published message of landmarks.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/types/odometry.h"

namespace perdure::vio {

/// Landmarks of one image (CV_8UC1) of `camera`, with descriptors. Landmarks that are not finite are
/// left out.
Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image);

}  // namespace perdure::vio

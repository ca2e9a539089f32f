// Converts landmarks to the published message.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/types/odometry.h"
#include "services/vio/core/update/landmark.h"

namespace perdure::vio {

/// Landmarks of one image (CV_8UC1) of `camera`. Estimates that are not finite are left out.
Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera,
                           const std::vector<LandmarkEstimate>& estimates, const cv::Mat& image);

}  // namespace perdure::vio

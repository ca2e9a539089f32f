// What is drawn over a camera's image, as foxglove.ImageAnnotations: the projected cuboids (dashed
// where something hides the object), and the detections, as bright as they are likely (the paper's
// figure 1).
#pragma once

#include <string>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"

namespace perdure::gateway {

/// `detections`: of the same frame and camera, or nullptr.
std::string imageAnnotations(const Objects& objects, const CameraModel& camera,
                             const Detections* detections);

}  // namespace perdure::gateway

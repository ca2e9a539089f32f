// What is drawn over a camera's image, as foxglove.ImageAnnotations: the projected cuboids (dashed
// where something hides the object), and the detections, as bright as they are likely (the paper's
// figure 1); and the objects as regions that are as bright as their class is likely.
#pragma once

#include <string>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"

namespace perdure::gateway {

/// `detections`: of the same frame and camera, or nullptr.
std::string imageAnnotations(const Objects& objects, const CameraModel& camera,
                             const Detections* detections);

/// The objects in sight as filled regions, as bright as their class is likely under the image (the
/// paper's figure 1, middle): by the box that meets the region, or by inference's answer to the
/// filter's prediction. Black: the network says nothing of it. `model`: of the detections.
std::string likelihoodRegions(const Objects& objects, const CameraModel& camera,
                              const Detections* detections, const ModelInfo* model);

}  // namespace perdure::gateway

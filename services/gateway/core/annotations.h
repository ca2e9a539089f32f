// Overlays of a camera's image, as foxglove.ImageAnnotations. One overlay shows the projected
// cuboids, dashed if the object is occluded, and the detected boxes, brighter if more likely. The
// other shows the objects as regions, brighter if their class is more likely (the paper's figure
// 1).
#pragma once

#include <string>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"

namespace perdure::gateway {

/// Returns the overlay with cuboids and boxes. `detections`: those of the same frame and camera, or
/// nullptr.
std::string imageAnnotations(const Objects& objects, const CameraModel& camera,
                             const Detections* detections);

/// Returns the overlay with the visible objects as filled regions. The brightness is the likelihood
/// of the object's class for the box that overlaps the region, or for inference's answer to a
/// prediction; black if there is none. `model`: the network of the detections, or nullptr.
std::string likelihoodRegions(const Objects& objects, const CameraModel& camera,
                              const Detections* detections, const ModelInfo* model);

}  // namespace perdure::gateway

// Overlays of a camera's image, as foxglove.ImageAnnotations. One overlay has the projected
// cuboids, dashed if the object is occluded, and the detections, with brightness by likelihood (the
// paper's figure 1). The other has the objects as regions, with brightness by the likelihood of
// their class.
#pragma once

#include <string>

#include "common/camera/camera_model.h"
#include "common/types/objects.h"

namespace perdure::gateway {

/// `detections`: of the same frame and camera, or nullptr.
std::string imageAnnotations(const Objects& objects, const CameraModel& camera,
                             const Detections* detections);

/// The visible objects as filled regions, with brightness by the likelihood of their class: of the
/// box that overlaps the region, or of inference's answer to a prediction. Black: not known.
/// `model`: of the detections.
std::string likelihoodRegions(const Objects& objects, const CameraModel& camera,
                              const Detections* detections, const ModelInfo* model);

}  // namespace perdure::gateway

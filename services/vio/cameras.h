// What exists once the cameras are known.
#pragma once

#include <vector>

#include "common/camera/camera_model.h"
#include "common/types/sensors.h"
#include "services/vio/config.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/tracks/tracker.h"

namespace perdure::vio {

/// One or two cameras, the first leads, with the tracker and the filter that are made for them.
struct Cameras {
  Cameras(const Config& config, const Options& options, const std::vector<CameraModel>& all);

  Tracker tracker;
  Estimator estimator;
  std::vector<CameraModel> models;
};

/// Those whose frames are read, in the order of the configuration: the first one leads, and the
/// second one is there where it is wanted. The calibration's first where it knows none of them.
std::vector<CameraModel> usedCameras(const Config& config, const Calibration& calibration);
/// A sentence where the configuration names a camera that is not there; empty otherwise, or where
/// it names none but the default's.
std::string unknownCamera(const Config& config, const Calibration& calibration);

/// What the estimators know of cameras: where on the body, and how long an image is read out, s.
std::vector<RigidTransform> extrinsics(const std::vector<CameraModel>& all);
std::vector<double> readouts(const std::vector<CameraModel>& all);

/// The same cameras in the same order, to the last digit.
bool sameCameras(const Calibration& a, const Calibration& b);

}  // namespace perdure::vio

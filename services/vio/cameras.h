// Objects that exist once the cameras are known.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/types/sensors.h"
#include "services/vio/config.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/tracks/tracker.h"
#include "services/vio/waiting_frames.h"

namespace perdure::vio {

/// One or two cameras, the first of which leads, with their tracker and filter.
struct Cameras {
  Cameras(const Config& config, const Options& options, const std::vector<CameraModel>& all);

  Tracker tracker;
  Estimator estimator;
  std::vector<CameraModel> models;
};

/// Cameras whose frames are read, by the configuration: the first leads, a second needs stereo.
/// Without any of them, the calibration's first camera.
std::vector<CameraModel> usedCameras(const Config& config, const Calibration& calibration);
/// A sentence if a camera other than the defaults is configured and does not exist; else empty.
std::string unknownCamera(const Config& config, const Calibration& calibration);

/// Camera parameters of the estimators: the mounting on the body, and the read-out time in s.
std::vector<RigidTransform> extrinsics(const std::vector<CameraModel>& all);
std::vector<double> readouts(const std::vector<CameraModel>& all);

/// Whether both calibrations have exactly the same cameras in the same order.
bool sameCameras(const Calibration& a, const Calibration& b);

/// A sentence with both sizes if the frame's size differs from its calibration; otherwise empty.
std::string otherSize(const Frame& frame, const CameraModel& model);

/// Index in `models` of the frame's camera; empty for others. An unknown camera is counted.
std::optional<std::size_t> cameraOf(const Frame& frame, const std::vector<CameraModel>& models,
                                    const Calibration& calibration, ReasonCounts& reasons);
/// The second image (CV_8UC1) of a pair, or empty; a missing one of a stereo rig is counted.
cv::Mat secondImage(const FramePair& frames, bool stereo, ReasonCounts& reasons);

}  // namespace perdure::vio

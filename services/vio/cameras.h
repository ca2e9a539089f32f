// The tracker and the filter, which need the calibration of the cameras, and helpers for frames.
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

/// Returns the cameras whose frames are read: those of the configuration that the calibration has,
/// two with `stereo`, otherwise one. The first one leads. If there is none, returns the
/// calibration's first camera.
std::vector<CameraModel> usedCameras(const Config& config, const Calibration& calibration);
/// Returns a sentence if input.cameras was changed and names a camera without calibration;
/// otherwise an empty string.
std::string unknownCamera(const Config& config, const Calibration& calibration);

/// Return parameters of each camera: its pose T_BC, and its read-out time in s.
std::vector<RigidTransform> extrinsics(const std::vector<CameraModel>& all);
std::vector<double> readouts(const std::vector<CameraModel>& all);

/// Replaces deviations that have their default values by those of the rig, if known.
void useDeviations(const CameraDeviations& rig, CalibrationOptions& options);

/// Selects estimates of the cameras for publication. Only cameras whose lens is estimated, or that
/// turned on the body, are published, and only if pixels move noticeably; at most every two
/// seconds.
class CameraNews {
 public:
  /// Sets the calibration to which the estimates belong. Published cameras are published again.
  void begin(const Calibration& given);
  /// Returns the calibration with the estimated cameras `models`, if it is to be published.
  std::optional<Calibration> take(const Estimator& estimator,
                                  const std::vector<CameraModel>& models);

 private:
  Calibration given_;
  std::vector<CameraModel> published_;
  TimePoint time_;  ///< of published_
  bool again_ = false;
};

/// Returns true if both calibrations have the same cameras in the same order.
bool sameCameras(const Calibration& a, const Calibration& b);

/// Returns a sentence if the frame's size differs from that of its calibration; otherwise an empty
/// string.
std::string otherSize(const Frame& frame, const CameraModel& model);

/// Returns the index in `models` of the frame's camera, or nothing if it is not among them. Counts
/// "frame_of_unknown_camera" if the calibration does not have it either.
std::optional<std::size_t> cameraOf(const Frame& frame, const std::vector<CameraModel>& models,
                                    const Calibration& calibration, ReasonCounts& reasons);
/// Returns the second image (CV_8UC1) of a pair; empty if it is missing or unreadable, which is
/// counted for a stereo rig.
cv::Mat secondImage(const FramePair& frames, bool stereo, ReasonCounts& reasons);

}  // namespace perdure::vio

// Geometry for Foxglove: frames, the pose and trajectory of the body, landmarks, the camera.
#pragma once

#include <string>
#include <vector>

#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::gateway {

/// map → odom → base_link → <camera>_optical.
std::string frameTransforms(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB,
                            const Calibration* calibration);
std::string poseInFrame(TimePoint time, const RigidTransform& T_WB);
/// Points with x, y, z and sigma as 32-bit floats.
std::string landmarksAsPoints(const Landmarks& landmarks);
std::string cameraCalibration(const CameraCalibration& camera, TimePoint time);

/// foxglove::CompressedImage as CDR (XCDR1, little-endian). `jpeg`: the image's bytes.
std::string compressedImage(const FrameStamp& stamp, const std::string& camera,
                            std::span<const std::uint8_t> jpeg);

/// Trajectory of the body, thinned to at most a few thousand points.
class Trajectory {
 public:
  void add(TimePoint time, const WorldId& world, const RigidTransform& T_WB);
  void clear() { poses_.clear(); }
  std::string posesInFrame() const;
  std::size_t size() const { return poses_.size(); }

 private:
  WorldId world_;
  TimePoint time_;
  double step_m_ = 0.25;
  std::vector<RigidTransform> poses_;
  RigidTransform newest_;
};

}  // namespace perdure::gateway

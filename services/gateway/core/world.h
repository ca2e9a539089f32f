// Geometry for Foxglove: frames, the pose and trajectory of the body, landmarks and cameras.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::gateway {

/// Returns the transforms map → odom → base_link → <camera>_optical, and odom → enu (x east,
/// y north) if the yaw of the x axis of W from east is known, in rad.
std::string frameTransforms(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB,
                            const Calibration* calibration, std::optional<double> yaw_from_east);
std::string poseInFrame(TimePoint time, const RigidTransform& T_WB);
/// Returns the landmarks as points with x, y, z and sigma as 32-bit floats.
std::string landmarksAsPoints(const Landmarks& landmarks);
std::string cameraCalibration(const CameraCalibration& camera, TimePoint time);

/// Returns foxglove::CompressedImage as CDR (XCDR1, little-endian). `jpeg`: the bytes of the image.
std::string compressedImage(const FrameStamp& stamp, const std::string& camera,
                            std::span<const std::uint8_t> jpeg);

/// The trajectory of the body, thinned to at most a few thousand points.
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

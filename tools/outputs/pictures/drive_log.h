// Short records of all frames, from which the pictures are drawn after the drive.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/types/detections.h"
#include "common/types/objects.h"

namespace perdure::tools {

struct ObjectGlance {
  ObjectId id = 0;
  std::string class_name;
  double existence = 0.0, moving = 0.0;
  bool confirmed = false;
  Visibility visibility = Visibility::kVisible;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< centre
  Eigen::Matrix3d p_covariance = Eigen::Matrix3d::Zero();
  double yaw = 0.0;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< length, width, height

  bool inSight() const {
    return visibility == Visibility::kVisible || visibility == Visibility::kPartial;
  }
  bool hidden() const { return visibility == Visibility::kOccluded; }
};
ObjectGlance glanceAt(const ObjectBelief& object);

struct DetectionGlance {
  Box box;
  double probability = 0.0;    ///< probability of the best class against clutter and other classes
  std::size_t best_class = 0;  ///< number of this class in its model
};

struct FrameGlance {
  FrameStamp stamp;
  bool has_objects = false;                   ///< an `objects` message was received for this frame
  RigidTransform T_WB;                        ///< valid if has_objects
  std::shared_ptr<const CameraModel> camera;  ///< as estimated by vio; null: as calibrated
  std::vector<ObjectGlance> objects;
  std::vector<DetectionGlance> detections;
};

/// Corners of an object's cuboid in W. The bits of the index select front or rear, left or right,
/// and top or bottom.
std::array<Eigen::Vector3d, 8> cornersOf(const ObjectGlance& object);

/// Collects messages by frame. A later message about the same frame replaces the earlier one.
class DriveLog {
 public:
  void add(const Objects& objects);
  void add(const Detections& detections);
  /// Sets the estimated camera of the following `objects`.
  void add(const CameraCalibration& camera) {
    camera_ = std::make_shared<const CameraModel>(camera);
  }

  const std::map<std::uint64_t, FrameGlance>& frames() const { return frames_; }

 private:
  FrameGlance& frameOf(const FrameStamp& stamp);
  std::map<std::uint64_t, FrameGlance> frames_;
  std::shared_ptr<const CameraModel> camera_;
};

}  // namespace perdure::tools

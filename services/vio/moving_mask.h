// Where in an image things are that the object filter calls moving: points on them say nothing of
// the camera's own motion. Off by default: vio then depends on nothing that depends on it.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure::vio {

struct MovingMaskOptions {
  bool enabled = false;
  double probability = 0.5;  ///< of moving, and of existing, at least
  double longest_s = 1.0;    ///< objects that are older are not believed
};

class MovingMask {
 public:
  explicit MovingMask(const MovingMaskOptions& options) : options_(options) {}

  /// Keeps what moves of the newest objects.
  void onObjects(const Objects& objects);
  /// Bounding boxes, in pixels and within the image, of the moving objects' cuboids at `now`, each
  /// gone on with its velocity. T_WB: the body in `world` then. None where the objects are of
  /// another world, too old, or of the future.
  std::vector<cv::Rect2f> boxes(const CameraModel& camera, const WorldId& world,
                                const RigidTransform& T_WB, TimePoint now) const;

 private:
  MovingMaskOptions options_;
  WorldId world_;
  TimePoint time_;
  Eigen::Vector3d up_W_ = Eigen::Vector3d::UnitZ();
  std::vector<ObjectBelief> moving_;
};

}  // namespace perdure::vio

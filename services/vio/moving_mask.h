// Image regions of objects that the object filter reports as moving. Points on these objects give
// no information about the motion of the camera. The mask is off by default, so that vio does not
// depend on a program that depends on vio.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure::vio {

struct MovingMaskOptions {
  bool enabled = false;
  double probability = 0.5;  ///< least probability of motion, and of existence
  double longest_s = 1.0;    ///< largest age of the objects
};

class MovingMask {
 public:
  explicit MovingMask(const MovingMaskOptions& options) : options_(options) {}

  void onObjects(const Objects& objects);
  /// Returns the boxes of the moving objects' cuboids, propagated to `now`, in px and clipped to
  /// the image. T_WB is the pose of the body in `world`. Returns none if the objects are of another
  /// world, too old, or later than `now`.
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

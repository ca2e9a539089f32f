// Image regions of moving objects, whose points say nothing about the camera's motion. Off by
// default, because objects depend on vio.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure::vio {

struct MovingMaskOptions {
  bool enabled = false;
  double probability = 0.5;  ///< lowest probability of moving, and of existing
  double longest_s = 1.0;    ///< largest age of the objects, s
};

class MovingMask {
 public:
  explicit MovingMask(const MovingMaskOptions& options) : options_(options) {}

  void onObjects(const Objects& objects);
  /// Boxes, px, of the moving objects' cuboids at `now`. T_WB: the body in `world`.
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

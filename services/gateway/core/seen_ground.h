// The ground that the cameras have seen, for the page: cells, each with the time of its last view.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "common/camera/ground_view.h"
#include "common/types/map.h"

namespace perdure::gateway {

class SeenGround {
 public:
  /// Marks what a camera has in view. `ground_m`: height of the ground in W.
  void add(const CameraModel& camera, const RigidTransform& T_WB, double ground_m, TimePoint time,
           const WorldId& world);
  /// Marks what the camera had in view at the anchors, at unknown times. `graph` must be in M.
  /// Cameras that look up or down on a level body are left out.
  void addAnchors(const CameraModel& camera, const MapReply& graph, const RigidTransform& T_MW,
                  double ground_m);
  void forgetAnchors() { before_.clear(); }
  void clear();
  bool empty() const { return seen_.empty() && before_.empty(); }

  /// Returns the cells near the body as "perdure.SeenGround".
  std::string json(const Eigen::Vector3d& p_WB, TimePoint now) const;

 private:
  using Cells = std::map<std::pair<int, int>, TimePoint>;
  WorldId world_;
  double ground_m_ = 0.0;
  Cells seen_, before_;
};

}  // namespace perdure::gateway

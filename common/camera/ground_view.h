// The cells of level ground that a camera has in its image, for records of what was seen.
#pragma once

#include <functional>

#include "common/camera/camera_model.h"

namespace perdure {

/// Whether the camera of a level body looks less than 60° up or down. Anchors of a map are level
/// poses; what another camera saw from them is not known, for example that of an upright phone.
bool looksAlongGround(const CameraModel& camera);

/// Level ground as cells: cell (i, j) has its centre at ((i + 1/2) cell_m, (j + 1/2) cell_m).
struct GroundGrid {
  double cell_m = 1.0;    ///< side of a cell
  double reach_m = 10.0;  ///< distance up to which the camera sees the ground
  double height_m = 0.0;  ///< z of the points that must be in the image
};

/// Calls `visit(i, j)` for each cell whose centre is in the image and within reach of the body.
/// `T_GB`: pose of the body in the level frame of the grid.
void forGroundInView(const CameraModel& camera, const RigidTransform& T_GB, const GroundGrid& grid,
                     const std::function<void(int, int)>& visit);

}  // namespace perdure

// The horizontal directions that the cameras see from an anchor.
#pragma once

#include <string>
#include <vector>

#include "common/types/odometry.h"
#include "common/types/sensors.h"

namespace perdure::mapping {

/// The horizontal field of view of a camera, in the axes of an anchor, rad.
struct Sight {
  double azimuth = 0.0;     ///< its middle, from x towards y
  double half_width = 0.0;  ///< (0, π]
  bool operator==(const Sight&) const = default;
};

/// Returns the fields of view of the cameras on a body at T_WB. The unit vector `up_W` points
/// against gravity. Leaves out cameras whose lens model cannot be inverted.
std::vector<Sight> sightsOf(const Calibration& calibration, const RigidTransform& T_WB,
                            const Eigen::Vector3d& up_W);

/// Convert to and from two numbers for each camera: azimuth and half width, rad. Text that is not
/// valid ends the list.
std::string toText(const std::vector<Sight>& sights);
std::vector<Sight> sightsFrom(const std::string& text);

}  // namespace perdure::mapping

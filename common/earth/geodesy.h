// WGS 84: geodetic coordinates, earth-centred ones (ECEF) and local east-north-up (ENU) ones.
// Source: NIMA TR8350.2; the inverse is Bowring's, iterated to below a micrometre.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"
#include "common/types/sensors.h"

namespace perdure {

struct Geodetic {
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;
};

Eigen::Vector3d toEcef(const Geodetic& g);
/// Requires a distance from the earth's centre, |ecef|, of at least 1000 km.
Geodetic fromEcef(const Eigen::Vector3d& ecef);
/// The rotation whose columns are east, north and up at g, in ECEF.
Eigen::Matrix3d enuAxes(const Geodetic& g);

/// Converts points of W to geodetic coordinates, given the pose of the body at the time of the
/// anchor.
class GeoReference {
 public:
  GeoReference(const GeoAnchor& anchor, const RigidTransform& T_WB_at_anchor);
  Geodetic operator()(const Eigen::Vector3d& p_W) const;

 private:
  Eigen::Vector3d origin_ecef_;
  Eigen::Matrix3d enu_axes_;
  Eigen::Matrix3d R_EW_;  ///< rotation from W to ENU, about the vertical
  Eigen::Vector3d p_WB_;
};

}  // namespace perdure

#include "common/earth/geodesy.h"

#include <cmath>
#include <numbers>

#include "common/math/so3.h"

namespace perdure {
namespace {
constexpr double kA = 6378137.0;            // semi-major axis, m
constexpr double kF = 1.0 / 298.257223563;  // flattening
constexpr double kE2 = kF * (2.0 - kF);     // first eccentricity squared
constexpr double kDeg = std::numbers::pi / 180.0;
}  // namespace

Eigen::Vector3d toEcef(const Geodetic& g) {
  const double lat = g.latitude_deg * kDeg, lon = g.longitude_deg * kDeg;
  const double n = kA / std::sqrt(1.0 - kE2 * std::sin(lat) * std::sin(lat));
  return {(n + g.height_m) * std::cos(lat) * std::cos(lon),
          (n + g.height_m) * std::cos(lat) * std::sin(lon),
          (n * (1.0 - kE2) + g.height_m) * std::sin(lat)};
}

Geodetic fromEcef(const Eigen::Vector3d& p) {
  const double r = std::hypot(p.x(), p.y());
  double lat = std::atan2(p.z(), r * (1.0 - kE2));
  for (int i = 0; i < 10; ++i) {
    const double n = kA / std::sqrt(1.0 - kE2 * std::sin(lat) * std::sin(lat));
    lat = std::atan2(p.z() + kE2 * n * std::sin(lat), r);
  }
  const double s = std::sin(lat), c = std::cos(lat);
  const double n = kA / std::sqrt(1.0 - kE2 * s * s);
  const double height = r * c + p.z() * s - kA * kA / n;
  return {lat / kDeg, std::atan2(p.y(), p.x()) / kDeg, height};
}

Eigen::Matrix3d enuAxes(const Geodetic& g) {
  const double lat = g.latitude_deg * kDeg, lon = g.longitude_deg * kDeg;
  const double sl = std::sin(lat), cl = std::cos(lat), so = std::sin(lon), co = std::cos(lon);
  Eigen::Matrix3d axes;
  axes.col(0) << -so, co, 0.0;
  axes.col(1) << -sl * co, -sl * so, cl;
  axes.col(2) << cl * co, cl * so, sl;
  return axes;
}

GeoReference::GeoReference(const GeoAnchor& anchor, const RigidTransform& T_WB) : p_WB_(T_WB.p) {
  const Geodetic origin{anchor.latitude_deg, anchor.longitude_deg, anchor.height_m};
  origin_ecef_ = toEcef(origin);
  enu_axes_ = enuAxes(origin);
  R_EW_ = rotationAboutZ(anchor.yaw - yawOf(T_WB.R()));
}

Geodetic GeoReference::operator()(const Eigen::Vector3d& p_W) const {
  return fromEcef(origin_ecef_ + enu_axes_ * (R_EW_ * (p_W - p_WB_)));
}

}  // namespace perdure

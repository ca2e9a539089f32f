#include "common/earth/geodesy.h"

#include <gtest/gtest.h>

#include <numbers>

namespace perdure {
namespace {

TEST(Geodesy, FromEcefInvertsToEcefFromPoleToEquator) {
  for (const double lat : {-89.9, -33.0, 0.0, 49.0, 89.9}) {
    const Geodetic g{lat, 8.4, 112.0};
    const Geodetic back = fromEcef(toEcef(g));
    EXPECT_NEAR(back.latitude_deg, lat, 1e-10);
    EXPECT_NEAR(back.longitude_deg, 8.4, 1e-10);
    EXPECT_NEAR(back.height_m, 112.0, 1e-5);
  }
}

TEST(Geodesy, EquatorAndPoleLieOnTheAxesOfTheEllipsoid) {
  EXPECT_NEAR(toEcef({0, 0, 0}).x(), 6378137.0, 1e-6);
  EXPECT_NEAR(toEcef({90, 0, 0}).z(), 6356752.314245, 1e-5);
}

TEST(GeoReference, AheadOfABodyThatFacesNorthIsNorth) {
  GeoAnchor anchor;
  anchor.latitude_deg = 49.0;
  anchor.longitude_deg = 8.0;
  anchor.yaw = std::numbers::pi / 2;  // north
  const RigidTransform T_WB(Eigen::Quaterniond::Identity(), Eigen::Vector3d(10, 0, 0));
  const Geodetic ahead = GeoReference(anchor, T_WB)(Eigen::Vector3d(110, 0, 0));
  EXPECT_NEAR(ahead.longitude_deg, 8.0, 1e-9);
  EXPECT_NEAR((ahead.latitude_deg - 49.0) * 111200.0, 100.0, 0.2);
  const Geodetic left = GeoReference(anchor, T_WB)(Eigen::Vector3d(10, 100, 0));
  EXPECT_LT(left.longitude_deg, 8.0);  // left of north is west
}

}  // namespace
}  // namespace perdure

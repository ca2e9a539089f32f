#include "common/types/directions.h"

#include <gtest/gtest.h>

namespace perdure {
namespace {

TEST(Directions, OfAnAzimuthAreItsSector) {
  EXPECT_EQ(sectorOf(0.01), 0);
  EXPECT_EQ(sectorOf(-0.01), 15);
  EXPECT_EQ(sectorOf(M_PI + 0.01), 8);
  EXPECT_EQ(sectorOf(M_PI - 0.01), 7);
  EXPECT_EQ(sectorOf(20 * M_PI + 0.4), 1);
  EXPECT_EQ(sectorOf(-20 * M_PI - 0.01), 15);
}

TEST(Directions, KeepTheFarthestDetection) {
  Directions seen_from = Directions::Zero();
  for (const double metres : {12.0, 30.0, 5.0}) addDirection(seen_from, 0.2, metres);
  EXPECT_EQ(seen_from[0], 30.0F);
  EXPECT_EQ(seen_from.sum(), 30.0F);
}

TEST(Directions, TurnWithTheirFrame) {
  for (double azimuth = -7.0; azimuth < 7.0; azimuth += 0.37) {
    Directions seen_from = Directions::Zero();
    addDirection(seen_from, azimuth, 1.0);
    for (int sectors = -16; sectors <= 16; ++sectors) {
      const double yaw = (sectors + 0.4) * kDirectionWidth;  // rounded down
      Directions there = Directions::Zero();
      addDirection(there, azimuth + sectors * kDirectionWidth, 1.0);
      EXPECT_EQ(turnedBy(seen_from, yaw), there) << azimuth << ' ' << sectors;
    }
  }
}

TEST(Directions, AngleToASectorIsZeroInside) {
  EXPECT_EQ(angleToSector(0, 0.01), 0.0);
  EXPECT_NEAR(angleToSector(0, -0.3), 0.3, 1e-12);
  EXPECT_NEAR(angleToSector(0, 0.5 * kDirectionWidth - M_PI), M_PI - 0.5 * kDirectionWidth, 1e-12);
}

}  // namespace
}  // namespace perdure

#include <gtest/gtest.h>

#include <cmath>

#include "services/inference/core/network/image_fit.h"

namespace perdure::inference {
namespace {

/// Up in a level camera whose images must be turned clockwise by `turn_deg` to be upright.
Eigen::Vector3d up(double turn_deg) {
  const double turn = turn_deg * M_PI / 180.0;
  return {-std::sin(turn), -std::cos(turn), 0.0};
}

TEST(Upright, BringsTheTopOfTheSceneToTheTopOfTheImage) {
  EXPECT_EQ(uprightQuarters({0, -1, 0}, 0), 0);
  EXPECT_EQ(uprightQuarters({-1, 0, 0}, 0), 1) << "up is at the left: clockwise";
  EXPECT_EQ(uprightQuarters({0, 1, 0}, 0), 2);
  EXPECT_EQ(uprightQuarters({1, 0, 0}, 0), 3);
}

TEST(Upright, ChangesTenDegreesBeyondHalfAQuarterInBothDirections) {
  for (int present = 0; present < 4; ++present) {
    for (const int way : {-1, 1}) {
      EXPECT_EQ(uprightQuarters(up(90 * present + way * 54), present), present);
      EXPECT_EQ(uprightQuarters(up(90 * present + way * 56), present), (present + way + 4) % 4);
    }
  }
}

TEST(Upright, StaysWhileTheCameraLooksUpOrDown) {
  const double c = std::cos(65 * M_PI / 180), s = std::sin(65 * M_PI / 180);
  EXPECT_EQ(uprightQuarters({-c, 0, s}, 0), 0);
  EXPECT_EQ(uprightQuarters({0, -c, -s}, 3), 3);
  EXPECT_EQ(uprightQuarters({-s, 0, -c}, 0), 1) << "25° down";
  EXPECT_EQ(uprightQuarters(Eigen::Vector3d::Constant(NAN), 2), 2);
}

}  // namespace
}  // namespace perdure::inference

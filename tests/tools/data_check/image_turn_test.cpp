#include "tools/data_check/image_turn.h"

#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

/// Points at depths of 1 to 4 m before a camera that rotates and moves.
std::vector<Flow> flowOf(const Eigen::Vector3d& rotation, const Eigen::Vector3d& way) {
  std::vector<Flow> flow;
  for (int i = 0; i < 120; ++i) {
    const double depth = 1.0 + 3.0 * (0.5 + 0.5 * std::sin(2.7 * i));
    const Eigen::Vector3d ray =
        Eigen::Vector3d(0.8 * std::sin(1.3 * i), 0.6 * std::cos(2.1 * i), 1.0).normalized();
    const Eigen::Vector3d moved = ray - way / depth;
    flow.push_back({ray, moved.normalized() - ray + ray.cross(rotation)});
  }
  return flow;
}

TEST(ImageTurn, TheWayOfTheCameraIsNoTurn) {
  const Eigen::Vector3d rotation(0.01, -0.02, 0.005);
  for (const Eigen::Vector3d& way : {Eigen::Vector3d(0.04, 0.0, 0.01), Eigen::Vector3d(0, 0.03, 0),
                                     Eigen::Vector3d(-0.02, 0.01, 0.05)}) {
    EXPECT_LT((rotationOf(flowOf(rotation, way)) - rotation).norm(), 0.001);
  }
  EXPECT_LT((rotationOf(flowOf(rotation, Eigen::Vector3d::Zero())) - rotation).norm(), 1e-5);
}

}  // namespace
}  // namespace perdure::tools

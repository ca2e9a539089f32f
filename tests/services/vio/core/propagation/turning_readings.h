// A fifth of a second of fast rotation and an initial state, for tests of derivatives.
#pragma once

#include <cmath>
#include <vector>

#include "common/math/so3.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio::test {

inline std::vector<ImuReading> turningReadings() {
  std::vector<ImuReading> readings;
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.02 * i;
    readings.push_back({fromNanoseconds(0) + durationFromSeconds(t),
                        Eigen::Vector3d(std::sin(9 * t) + 0.4, 1.5 * std::cos(7 * t), 0.8 - 3 * t),
                        Eigen::Vector3d(2 * std::sin(5 * t), 9.8 - 4 * t, 3 * std::cos(11 * t))});
  }
  return readings;
}

inline Nav navInTheMiddle() {
  Nav nav;
  nav.q_WB = expQuaternion(Eigen::Vector3d(0.3, -0.7, 1.1));
  nav.p_WB = {1, 2, 3};
  nav.v_WB = {0.5, -1.5, 0.7};
  nav.gyro_bias = {0.02, -0.05, 0.03};
  nav.accel_bias = {0.1, 0.2, -0.15};
  return nav;
}

}  // namespace perdure::vio::test

#include "services/vio/core/update/standstill.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perdure::vio {
namespace {

constexpr std::chrono::milliseconds kWindow{500};

/// Samples of 3 s at 200 Hz: gravity, sine waves of `shake` m/s² and `turn` rad/s at `hz`, and
/// white vibration of `noise` m/s².
ImuBuffer samples(double shake, double turn, double hz, double noise) {
  std::mt19937 random(5);
  std::normal_distribution<double> white(0.0, 1.0);
  ImuBuffer imu;
  for (int i = 0; i <= 600; ++i) {
    const double wave = std::sin(2.0 * M_PI * hz * 5e-3 * i);
    const Eigen::Vector3d vibration(white(random), white(random), white(random));
    EXPECT_TRUE(imu.add({fromNanoseconds(5'000'000 * std::int64_t{i}),
                         Eigen::Vector3d(0.0, turn * wave, 0.0) + 0.02 * noise * vibration,
                         Eigen::Vector3d(0.2 * shake, 0.0, shake) * wave +
                             Eigen::Vector3d(0, 0, 9.81) + noise * vibration}));
  }
  return imu;
}

/// Number of windows between 1 s and 3 s in which the readings count as constant, of 81.
int evenWindows(const ImuBuffer& imu) {
  int even = 0;
  for (int i = 200; i <= 600; i += 5) {
    even += imuIsEven(imu, fromNanoseconds(5'000'000 * std::int64_t{i}), kWindow, {}) ? 1 : 0;
  }
  return even;
}

TEST(ImuIsEven, InTheVibrationOfAnEngine) {
  EXPECT_GE(evenWindows(samples(0.0, 0.0, 1.0, 0.0)), 80);
  EXPECT_GE(evenWindows(samples(0.0, 0.0, 1.0, 1.0)), 75);
  EXPECT_GE(evenWindows(samples(1.0, 0.0, 37.0, 0.3)), 75);
}

// A person who carries the camera takes about two steps per second.
TEST(ImuIsEven, NotInStepsThatShakeNoMoreThanAnEngine) {
  EXPECT_LE(evenWindows(samples(1.5, 0.3, 1.9, 0.1)), 8);
  EXPECT_LE(evenWindows(samples(1.0, 0.3, 1.7, 0.2)), 8);
}

}  // namespace
}  // namespace perdure::vio

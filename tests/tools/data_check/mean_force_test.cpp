#include "tools/data_check/samples/mean_force.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

using testing::HasSubstr;

/// 20 s of a body that turns by up to 30° about each axis and pushes to and fro.
replay::DataFindings findingsAfter(const std::function<void(ImuSample&)>& change) {
  constexpr double kStep_s = 0.005;
  std::vector<ImuSample> samples;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  for (int i = 0; i < 4000; ++i) {
    const double t = i * kStep_s;
    ImuSample sample;
    sample.time = TimePoint(durationFromSeconds(1000.0 + t));
    sample.gyro = 0.5 * Eigen::Vector3d(std::sin(t), std::cos(1.3 * t), std::sin(0.7 * t));
    sample.accel =
        q_WB.conjugate() * Eigen::Vector3d(1.5 * std::sin(3.0 * t), std::cos(2.0 * t), 9.81);
    q_WB = (q_WB * expQuaternion(kStep_s * sample.gyro)).normalized();
    change(sample);
    samples.push_back(sample);
  }
  return checkMeanForce(samples);
}

std::string textAfter(const std::function<void(ImuSample&)>& change) {
  const auto found = findingsAfter(change);
  return found.empty() ? "" : found.front().code + ": " + found.front().text;
}

TEST(MeanForce, ASoundAccelerometerHasNoFinding) {
  EXPECT_EQ(textAfter([](ImuSample&) {}), "");
  EXPECT_EQ(textAfter([](ImuSample& sample) {
              sample.accel += Eigen::Vector3d(0.1, -0.1, 0.15);
              sample.gyro += Eigen::Vector3d(0.01, -0.01, 0.01);
            }),
            "")
      << "biases of a cheap sensor";
}

TEST(MeanForce, PushesOfAFastVehicleAreNoFinding) {
  // Full acceleration, then an emergency stop; then rest.
  EXPECT_EQ(textAfter([](ImuSample& sample) {
              const double t = toSeconds(sample.time.time_since_epoch()) - 1000.0;
              sample.accel.x() += t > 4 && t < 8 ? 5.0 : t > 8 && t < 10.5 ? -8.0 : 0.0;
            }),
            "");
}

TEST(MeanForce, AWrongScaleIsNamedWithItsFactor) {
  EXPECT_THAT(textAfter([](ImuSample& sample) { sample.accel *= 1.06; }),
              testing::AllOf(HasSubstr("accel_factor"), HasSubstr("1.06")));
}

TEST(MeanForce, ASignThatChangesInMidDriveIsNamedWithTheTime) {
  const auto text = textAfter([](ImuSample& sample) {
    if (toSeconds(sample.time.time_since_epoch()) > 1009.9) sample.accel.z() *= -1.0;
  });
  EXPECT_THAT(text, testing::AllOf(HasSubstr("accel_changes"),
                                   HasSubstr("which the gyroscope does not show between 10080"),
                                   HasSubstr("and 10100")));
}

TEST(MeanForce, ABiasThatChangesInMidDriveIsNamedWithBothSizes) {
  const auto text = textAfter([](ImuSample& sample) {
    if (toSeconds(sample.time.time_since_epoch()) > 1009.9) sample.accel *= 1.12;
  });
  EXPECT_THAT(text, testing::AllOf(HasSubstr("accel_changes"), HasSubstr("from 9.8"),
                                   HasSubstr("to 10.9")));
}

}  // namespace
}  // namespace perdure::tools

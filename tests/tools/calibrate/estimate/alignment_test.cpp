#include "tools/calibrate/estimate/alignment.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "tools/calibrate/simulated.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

struct Motion {
  std::vector<CameraPose> poses;
  std::vector<ImuReading> readings;
  CameraCalibration truth;
};

Motion motionOf(std::uint64_t seed, double offset_s) {
  SimulatedOptions options;
  options.seed = seed;
  options.seconds = 15.0;
  const auto simulated = simulateCalibration(options);
  Motion motion;
  motion.truth = simulated.truth();
  motion.truth.time_offset_s = offset_s;
  for (double t = 1.0; t < 14.0; t += 0.05) {
    motion.poses.push_back({t - offset_s, simulated.T_CT(t).inverse()});
  }
  for (const auto& sample : simulateSamples(simulated)) {
    motion.readings.push_back(
        {toSeconds(sample.time - tools::kSceneEpoch), sample.gyro, sample.accel});
  }
  return motion;
}

TEST(AlignRates, FindsRotationAndTimeOffset) {
  for (const double offset : {-0.21, -0.013, 0.0, 0.0075, 0.18}) {
    const Motion motion = motionOf(3, offset);
    const auto found = alignRates(motion.poses, motion.readings, 0.3);
    ASSERT_TRUE(found) << found.error().detail;
    const Eigen::Vector3d error =
        logSo3(Eigen::Quaterniond(found->q_BC.conjugate() * motion.truth.T_BC.q));
    EXPECT_LT(error.norm(), 0.02) << offset;
    EXPECT_NEAR(found->time_offset_s, offset, 0.003);
  }
}

TEST(AlignRates, AnOffsetBeyondTheSearchIsNotGuessed) {
  const Motion motion = motionOf(3, 0.5);
  const auto found = alignRates(motion.poses, motion.readings, 0.1);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "calibrate_time_offset");
  EXPECT_NE(found.error().detail.find("--max-offset"), std::string::npos);
}

TEST(AlignRates, TurningAboutOneAxisIsTooLittle) {
  Motion motion = motionOf(3, 0.0);
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    const double angle = 0.5 * std::sin(3.0 * motion.poses[i].time_s);
    motion.poses[i].T_TC.q = expQuaternion({0, angle, 0});
  }
  for (ImuReading& r : motion.readings) r.gyro = {0, 1.5 * std::cos(3.0 * r.time_s), 0};
  const auto found = alignRates(motion.poses, motion.readings, 0.3);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "calibrate_no_rotation");
  EXPECT_NE(found.error().detail.find("about all"), std::string::npos);
}

}  // namespace
}  // namespace perdure::calibrate

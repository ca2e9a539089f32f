#include "services/capture/live/imu_pairing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

Triad at(double ms, const Eigen::Vector3d& v) { return {static_cast<std::int64_t>(ms * kMs), v}; }
Eigen::Vector3d ramp(double ms) { return {ms, -2.0 * ms, 9.81}; }

TEST(ImuPairing, GivesOneScanOfOneDeviceAtOnce) {
  ImuPairing pairing;
  EXPECT_TRUE(pairing.accel(at(5, {1, 2, 3})).empty());
  const auto pairs = pairing.gyro(at(5, {4, 5, 6}));
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].time_ns, 5 * kMs);
  EXPECT_EQ(pairs[0].accel, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(pairs[0].gyro, Eigen::Vector3d(4, 5, 6));
}

TEST(ImuPairing, PutsTheAccelerationBetweenItsReadings) {
  ImuPairing pairing;
  std::vector<InertialPair> all;
  const auto keep = [&](const auto& more) { all.insert(all.end(), more.begin(), more.end()); };
  for (int i = 0; i < 100; ++i) {  // the accelerometer has a sample every 4 ms, the gyroscope every
                                   // 5 ms
    if (i % 4 == 0) keep(pairing.accel(at(i, ramp(i))));
    if (i % 5 == 1) keep(pairing.gyro(at(i, {double(i), 0, 0})));
  }
  ASSERT_GE(all.size(), 19U);
  for (const auto& pair : all) {
    const double ms = static_cast<double>(pair.time_ns) / kMs;
    EXPECT_EQ(pair.gyro.x(), ms);
    EXPECT_TRUE(pair.accel.isApprox(ramp(ms), 1e-12)) << pair.accel.transpose();
  }
  EXPECT_TRUE(pairing.reasons().all().empty());
}

TEST(ImuPairing, TakesReadingsThatComeInBlocks) {
  ImuPairing pairing;
  std::size_t given = 0;
  for (int block = 0; block < 20; ++block) {
    for (int i = 0; i < 8; ++i) given += pairing.gyro(at(40 * block + 5 * i + 1, {0, 0, 0})).size();
    for (int i = 0; i < 10; ++i) given += pairing.accel(at(40 * block + 4 * i, ramp(0))).size();
  }
  EXPECT_GE(given, 158U);
  EXPECT_TRUE(pairing.reasons().all().empty());
}

TEST(ImuPairing, LeavesOutWhatHasNoPartnerAndSaysSo) {
  ImuPairing pairing;
  EXPECT_TRUE(pairing.gyro(at(10, {0, 0, 0})).empty());
  EXPECT_TRUE(pairing.accel(at(20, ramp(20))).empty()) << "it was before the first acceleration";
  EXPECT_EQ(pairing.reasons().of("imu_unpaired"), 1U);
  (void)pairing.gyro(at(30, {0, 0, 0}));
  for (int ms = 40; ms <= 200; ms += 10) (void)pairing.gyro(at(ms, {0, 0, 0}));
  EXPECT_GT(pairing.reasons().of("imu_unpaired"), 5U) << "the accelerometer is silent";
  (void)pairing.gyro(at(100, {0, 0, 0}));
  (void)pairing.accel(at(20, ramp(20)));
  EXPECT_EQ(pairing.reasons().of("imu_out_of_order"), 2U);
}

}  // namespace
}  // namespace perdure::capture

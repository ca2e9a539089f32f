#include "services/vio/core/state/saved_state.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/state_file.h"

namespace perdure::vio {
namespace {

SavedState someState() {
  SavedState s;
  s.world = {0xfedcba9876543210ull, 3};
  s.time = fromNanoseconds(1317042272345808896);
  s.nav.q_WB = expQuaternion(Eigen::Vector3d(0.1, 0.2, -2.0));
  s.nav.p_WB = {1.0 / 3.0, -2e-17, 1e5};
  s.nav.v_WB = {5, 6, 7};
  s.T_BC = {RigidTransform(expQuaternion(Eigen::Vector3d(1, 1, 0)), Eigen::Vector3d(0.1, 0, 0))};
  s.time_offset_s = 0.0071;
  s.readout_s = {0.0213};
  s.lens.assign(1, (LensError() << 1e-3, 2.0, -1.0, 1.0 / 3.0, 0.02).finished());
  s.estimated = {.readout = true, .scale = true, .lens = true};
  s.gyro_scale = {1.003, 0.999, 1.0 / 0.995};
  s.covariance = 0.01 * Eigen::MatrixXd::Identity(31, 31);
  s.next_track = 12345;
  return s;
}

TEST(SavedState, ComesBackToTheLastBit) {
  const SavedState s = someState();
  const auto back = fromText(toText(s));
  ASSERT_TRUE(back) << back.error().detail;
  EXPECT_EQ(back->world, s.world);
  EXPECT_EQ(back->time, s.time);
  EXPECT_EQ(back->nav.q_WB.coeffs(), s.nav.q_WB.coeffs());
  EXPECT_EQ(back->nav.p_WB, s.nav.p_WB);
  EXPECT_EQ(back->time_offset_s, s.time_offset_s);
  EXPECT_EQ(back->readout_s, s.readout_s);
  EXPECT_EQ(back->lens, s.lens);
  EXPECT_EQ(back->gyro_scale, s.gyro_scale);
  EXPECT_EQ(back->covariance, s.covariance);
  EXPECT_EQ(back->next_track, s.next_track);
  EXPECT_EQ(toText(*back), toText(s));
}

TEST(SavedState, WhatIsCutOffOrAlteredIsRefused) {
  const std::string text = toText(someState());
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, text.size() / 2}) {
    EXPECT_EQ(fromText(text.substr(0, length)).error().code, "state_malformed");
  }
  std::string earlier = text;
  earlier.replace(earlier.find("state-4"), 7, "state-3");
  EXPECT_EQ(fromText(earlier).error().detail, "its check sum or version does not fit");
  std::string altered = text;
  altered[text.size() / 2] = altered[text.size() / 2] == '1' ? '2' : '1';
  EXPECT_EQ(fromText(altered).error().code, "state_malformed");
}

TEST(SavedState, CoastingMovesOnAndTrustsLess) {
  SavedState s = someState();
  coast(s, 0.5);
  EXPECT_NEAR((s.nav.p_WB - Eigen::Vector3d(1.0 / 3.0 + 2.5, 3.0, 1e5 + 3.5)).norm(), 0.0, 1e-9);
  EXPECT_TRUE(isCovariance(s.covariance));
  EXPECT_GT(s.covariance(0, 0), 0.02);
  EXPECT_GT(s.covariance(3, 3), s.covariance(15, 15));
}

TEST(StateFile, KeepsTheNewestTextWhole) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("perdure_vio_state_" + std::to_string(::getpid()));
  const StateFile file(folder.string());
  EXPECT_FALSE(file.read());
  ASSERT_TRUE(file.write("one"));
  ASSERT_TRUE(file.write("two"));
  EXPECT_EQ(file.read(), "two");
  std::filesystem::remove_all(folder);
  EXPECT_EQ(file.write("three").error().code, "state_not_written");
}

}  // namespace
}  // namespace perdure::vio

#include "tools/evaluate/object_score.h"

#include <gtest/gtest.h>

#include <numbers>

namespace perdure::tools {
namespace {

/// W is the rectified camera: x right, y down, z forward, so that a row's yaw is about z. This
/// suffices for tests without orientations.
replay::KittiCalibration camera() {
  replay::KittiCalibration calibration;
  calibration.P2 << 700, 0, 600, 0, 0, 700, 180, 0, 0, 0, 1, 0;
  calibration.width = 1242, calibration.height = 375;
  return calibration;
}

EstimateRow rowAt(double x, double z, std::uint64_t id = 1, std::uint64_t frame = 0) {
  EstimateRow row;
  row.frame = frame;
  row.id = id;
  row.class_name = "car";
  row.centre_W = Eigen::Vector3d(x, 1.0, z);
  row.length = 4.0, row.width = 1.5, row.height = 1.6;
  return row;
}

TruthLabel labelAt(double x, double z, std::int64_t track = 7) {
  TruthLabel label;
  label.track = track;
  label.centre = Eigen::Vector3d(x, 1.0, z);
  label.heading = 0.0;
  label.box = toCamera(rowAt(x, z), RigidTransform(), camera())->box;
  return label;
}

ObjectScore score(const std::vector<EstimateRow>& rows, const std::vector<TruthFrame>& frames,
                  bool strict = false) {
  std::map<std::uint64_t, TruthFrame> truth;
  PosesByFrame poses;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    truth[i] = frames[i];
    poses[i] = RigidTransform();
  }
  return scoreObjects(rows, truth, poses, camera(), {.strict = strict});
}

TEST(ObjectScore, DistanceDecidesTheCell) {
  const auto s =
      score({rowAt(0.8, 20)}, {{.counted = {labelAt(0, 20)}, .ignored = {}, .dont_care = {}}});
  EXPECT_EQ(s.cells[0][2].matched, 0U);
  EXPECT_EQ(s.cells[0][2].false_alarms, 1U);
  EXPECT_EQ(s.cells[1][2].matched, 1U);
  EXPECT_EQ(s.cells[2][2].recall(), 1.0);
  EXPECT_NEAR(s.position_error_m, 0.8, 1e-12);
}

TEST(ObjectScore, AngleIsModuloAFullTurnAndAnyMeansAny) {
  auto label = labelAt(0, 20);
  for (const double turn : {0.0, 2 * std::numbers::pi - 0.4}) {
    label.heading = turn;  // the estimate has a heading of 0
    const auto s = score({rowAt(0, 20)}, {{.counted = {label}, .ignored = {}, .dont_care = {}}});
    EXPECT_EQ(s.cells[2][0].matched, 1U) << turn;
  }
  label.heading = std::numbers::pi;
  const auto s = score({rowAt(0, 20)}, {{.counted = {label}, .ignored = {}, .dont_care = {}}});
  EXPECT_EQ(s.cells[2][1].matched, 0U);
  EXPECT_EQ(s.cells[2][1].false_alarms, 1U);
  EXPECT_EQ(s.cells[2][2].matched, 1U);
}

TEST(ObjectScore, PairsAreTakenByIncreasingDistanceOneToOne) {
  // Estimate 2 is nearest to truth A; estimate 1 can match only A.
  const TruthFrame truth{{labelAt(0, 20, 1), labelAt(2.0, 20, 2)}, {}, {}};
  const auto s = score({rowAt(-0.9, 20, 1), rowAt(0.8, 20, 2)}, {truth});
  EXPECT_EQ(s.cells[2][2].matched, 1U);
  EXPECT_EQ(s.cells[2][2].false_alarms, 1U);
  EXPECT_EQ(s.duplicates, 1U);
}

TEST(ObjectScore, EstimatesWhoseCentreIsOutsideTheImageAreDropped) {
  const auto s = score({rowAt(-40, 20), rowAt(0, -20)}, {TruthFrame{}});
  EXPECT_EQ(s.outside, 2U);
  EXPECT_EQ(s.cells[2][2].false_alarms, 0U);
}

TEST(ObjectScore, AnEstimateOnAnIgnoredLabelIsNeutralUnlessStrict) {
  const TruthFrame truth{{}, {labelAt(0, 20)}, {}};
  EXPECT_EQ(score({rowAt(0, 21)}, {truth}).cells[2][2].false_alarms, 0U) << "within 1.5 m";
  EXPECT_EQ(score({rowAt(0, 23)}, {truth}).cells[2][2].false_alarms, 0U) << "the same box";
  EXPECT_EQ(score({rowAt(8, 20)}, {truth}).cells[2][2].false_alarms, 1U) << "neither";
  EXPECT_EQ(score({rowAt(0, 21)}, {truth}, true).cells[2][2].false_alarms, 1U);
}

TEST(ObjectScore, HalfTheBoxInADontCareRegionIsNeutral) {
  const Box box = labelAt(0, 20).box;
  Box region{box.x1, box.y1, box.x1 + 0.6 * box.width(), box.y2};
  EXPECT_EQ(score({rowAt(0, 20)}, {{.counted = {}, .ignored = {}, .dont_care = {region}}})
                .cells[2][2]
                .false_alarms,
            0U);
  region.x2 = box.x1 + 0.4 * box.width();
  EXPECT_EQ(score({rowAt(0, 20)}, {{.counted = {}, .ignored = {}, .dont_care = {region}}})
                .cells[2][2]
                .false_alarms,
            1U);
}

TEST(ObjectScore, AnEstimateThatOverlapsACountedTruthMoreIsAFalseAlarm) {
  // The estimate is 1.4 m from the ignored label in space. Its box overlaps the counted label,
  // which is 3 m away.
  const TruthFrame truth{{labelAt(0, 20, 1)}, {labelAt(1.3, 23, 2)}, {}};
  const auto s = score({rowAt(0.2, 22.2)}, {truth});
  EXPECT_EQ(s.cells[2][2].matched, 0U);
  EXPECT_EQ(s.cells[2][2].false_alarms, 1U);
  EXPECT_EQ(s.neutral, 0U);
}

TEST(ObjectScore, AnotherIdForTheSameTruthIsASwitchAndAGapAnInterruption) {
  const TruthFrame truth{{labelAt(0, 20)}, {}, {}};
  const auto s = score({rowAt(0, 20, 1, 0), rowAt(0, 20, 1, 2), rowAt(0, 20, 5, 3)},
                       {truth, truth, truth, truth});
  EXPECT_EQ(s.id_switches, 1U);
  EXPECT_EQ(s.interruptions, 1U);
  EXPECT_EQ(s.ids_matched, 2U);
  EXPECT_EQ(s.objects, 1U);
  EXPECT_NEAR(s.mean_object_recall, 0.75, 1e-12);
  EXPECT_NEAR(s.minutes, 0.4 / 60, 1e-12);
}

TEST(ObjectScore, ObjectsOfTheMapAreCountedForEachTrueOneThatWasFound) {
  const TruthFrame truth{{labelAt(0, 20, 1), labelAt(8, 20, 2), labelAt(-8, 20, 3)}, {}, {}};
  const auto s = score({rowAt(0, 20, 1), rowAt(0.9, 20, 2), rowAt(8.3, 20, 3)}, {truth});
  EXPECT_EQ(s.duplicates, 1U);
  EXPECT_NEAR(s.idsPerFound(), 3.0 / 2.0, 1e-12) << "two for the first, one for the second";
  EXPECT_NEAR(s.cells[1][2].positionError(), 0.15, 1e-12);
  EXPECT_EQ(score({}, {truth}).idsPerFound(), 1.0);
}

TEST(ObjectScore, FalseAlarmsAndMissesAreListedWithWhatIsNearest) {
  const TruthFrame truth{{labelAt(0, 20, 7)}, {}, {}};
  const auto s = score({rowAt(0, 23, 9)}, {truth});
  ASSERT_EQ(s.mishaps.size(), 2U);
  EXPECT_EQ(s.mishaps[0].id, 9);
  EXPECT_FALSE(s.mishaps[0].miss);
  EXPECT_NEAR(s.mishaps[0].nearest_m, 3.0, 1e-12);
  EXPECT_EQ(s.mishaps[1].id, 7);
  EXPECT_TRUE(s.mishaps[1].miss);
}

TEST(ObjectScore, RowsOfFramesWithoutAPoseCannotCount) {
  const auto s =
      score({rowAt(0, 20, 1, 9)}, {{.counted = {labelAt(0, 20)}, .ignored = {}, .dont_care = {}}});
  EXPECT_EQ(s.cells[2][2].matched, 0U);
  EXPECT_EQ(s.cells[2][2].truth, 1U);
  EXPECT_EQ(s.outside, 1U);
}

TEST(ObjectScore, YawInWBecomesRotationAboutTheCamerasVertical) {
  // W: x forward, y left, z up. A car that heads along W's x drives along the camera's z, and
  // KITTI's rotation_y is -pi/2. A car that heads to W's right (yaw -pi/2) has rotation_y 0.
  Eigen::Matrix3d R_RW;
  R_RW << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const RigidTransform T_RW(R_RW, Eigen::Vector3d::Zero());
  EstimateRow row;
  row.centre_W = Eigen::Vector3d(20, 0, 0);
  row.length = 4, row.width = 2, row.height = 1.5;
  EXPECT_NEAR(toCamera(row, T_RW, camera())->heading, -std::numbers::pi / 2, 1e-12);
  row.yaw = -std::numbers::pi / 2;
  const auto seen = toCamera(row, T_RW, camera());
  EXPECT_NEAR(seen->heading, 0.0, 1e-12);
  EXPECT_NEAR(seen->box.width(), 700 * 4.0 / 19.0, 1e-9) << "the near face, 1 m before the centre";
  EXPECT_NEAR(seen->box.height(), 700 * 1.5 / 19.0, 1e-9);
}

}  // namespace
}  // namespace perdure::tools

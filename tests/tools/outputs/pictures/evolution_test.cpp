#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "tests/tools/outputs/pixels.h"
#include "tests/tools/outputs/scene.h"
#include "tools/outputs/pictures/chart.h"
#include "tools/outputs/pictures/evolution_picture.h"
#include "tools/outputs/pictures/truth_sources.h"

namespace perdure::tools {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::Pointwise;
using ::testing::SizeIs;

TruthTrack standing(std::uint64_t id, const Eigen::Vector3d& centre) {
  TruthTrack track;
  track.id = id;
  track.keys.push_back({{}, centre, 0.0});
  return track;
}

/// 40 frames with four objects: a car always in view, a car in 20 frames, a chair hidden from 10 to
/// 19, and an unconfirmed one.
DriveLog drive() {
  DriveLog log;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const bool hidden = i >= 10 && i < 20;
    std::vector<ObjectGlance> objects = {
        objectAt(1, {10.0 + 1.0 / (1.0 + static_cast<double>(i)), 0, 0}),
        objectAt(3, {5, 1, 0}, hidden ? Visibility::kOccluded : Visibility::kVisible, "chair"),
        objectAt(4, {7, 7, 0})};
    objects[2].confirmed = false;
    if (i < 20) objects.push_back(objectAt(2, {20, 0, 0}));
    log.add(messageOf(frameOf(i, objects)));
  }
  return log;
}

TEST(Evolution, TakesTheLongestSeenOfEachClassFirstAndNoGuesses) {
  const auto ids = [](std::size_t most) {
    std::vector<ObjectId> result;
    for (const auto& one : chooseEvolutions(drive(), nullptr, most)) result.push_back(one.id);
    return result;
  };
  EXPECT_THAT(ids(2), ElementsAre(1, 3));
  EXPECT_THAT(ids(9), ElementsAre(1, 3, 2));
  DriveLog log;
  for (std::uint64_t i = 0; i < 3; ++i) {
    std::vector<ObjectGlance> objects = {objectAt(1, {9, 0, 0}, Visibility::kVisible, kOtherClass)};
    if (i > 0) objects.push_back(objectAt(2, {5, 0, 0}));
    log.add(messageOf(frameOf(i, objects)));
  }
  EXPECT_EQ(chooseEvolutions(log, nullptr, 1)[0].id, 2u) << "what it is counts for more";
}

TEST(Evolution, TheErrorIsTheDistanceFromTheNearestTruthAndElseThereIsNone) {
  PictureTruth truth;
  truth.objects = {standing(7, {10, 0, 0}), standing(8, {10.5, 0, 0}), standing(9, {50, 0, 0})};
  const auto evolutions = chooseEvolutions(drive(), &truth, 3);
  ASSERT_THAT(evolutions, SizeIs(3));
  ASSERT_THAT(evolutions[0].points, SizeIs(40));
  EXPECT_NEAR(*evolutions[0].points[0].error, 1.0, 1e-9);
  EXPECT_NEAR(*evolutions[0].points[39].error, 1.0 / 40, 1e-9);
  EXPECT_NEAR(evolutions[0].points[0].sigma, std::sqrt(0.03), 1e-9);
  EXPECT_NEAR(evolutions[0].points[0].existence, 0.9, 1e-12);
  EXPECT_FALSE(evolutions[2].points[0].error) << "30 m away is another thing";
}

TEST(Evolution, WhatOnlyPassesATruthIsNotTakenForIt) {
  DriveLog log;
  for (std::uint64_t i = 0; i < 40; ++i) {
    log.add(messageOf(frameOf(i, {objectAt(1, {static_cast<double>(i), 0, 0})})));
  }
  PictureTruth truth;
  truth.objects = {standing(7, {39, 0, 0})};
  EXPECT_FALSE(chooseEvolutions(log, &truth, 1)[0].points[39].error);
}

TEST(Evolution, HiddenPhasesAreShadedAndOthersAreNot) {
  const auto evolutions = chooseEvolutions(drive(), nullptr, 2);
  EXPECT_EQ(evolutions[1].points[9].phase, Phase::kInSight);
  EXPECT_EQ(evolutions[1].points[10].phase, Phase::kHidden);
  EXPECT_EQ(evolutions[1].points[20].phase, Phase::kInSight);
  const cv::Mat picture = drawEvolutions(evolutions);
  const auto shaded = [](const cv::Mat& row) {
    return count(row, mixed(kPaper, Colour(150, 150, 235), 0.55), 3.0);
  };
  const cv::Mat first = picture.rowRange(90, 240), second = picture.rowRange(282, 430);
  EXPECT_EQ(shaded(first), 0) << "the car was never hidden";
  const double share = shaded(second) / (2.0 * 651 * 146);
  EXPECT_NEAR(share, 10.0 / 39, 0.03);
}

TEST(Chart, TicksAreRoundAndCoverTheRange) {
  EXPECT_THAT(ticksOf(0, 1.05, 4), Pointwise(DoubleNear(1e-12), {0.0, 0.5, 1.0}));
  EXPECT_THAT(ticksOf(-3, 17, 6), Pointwise(DoubleNear(1e-12), {0.0, 5.0, 10.0, 15.0}));
  EXPECT_THAT(ticksOf(100, 1300, 8), SizeIs(6));  // steps of 200
  for (const double high : {0.13, 1.0, 3.7, 99.0, 100.0, 2040.0}) {
    EXPECT_LE(ticksOf(0, high, 8).size(), 8u) << high;
    EXPECT_GE(ticksOf(0, high, 8).size(), 4u) << high;
  }
  EXPECT_THAT(ticksOf(5, 5, 8), SizeIs(1));
}

TEST(Chart, NumbersOfScalesAreRoundAndZeroHasNoSign) {
  EXPECT_EQ(roundBelow(23.26), 20.0);
  EXPECT_EQ(roundBelow(100.0), 100.0);
  EXPECT_NEAR(roundBelow(0.07), 0.05, 1e-12);
  EXPECT_EQ(numberText(-0.0), "0");
  EXPECT_EQ(numberText(0.1 + 0.2), "0.3");
}

TEST(Chart, PointsOutsideTheRangeStayAtTheEdge) {
  cv::Mat picture(100, 200, CV_8UC3, kPaper);
  Chart chart(picture, {20, 10, 150, 60}, {0, 10}, {0, 1});
  chart.drawCurve({{0, 5}, {10, 5}}, {kTruthColour, 1});
  EXPECT_GE(count(picture.rowRange(9, 12), kTruthColour, 60), 140);
  EXPECT_EQ(count(picture.rowRange(0, 8), kTruthColour, 60), 0);
}

TEST(Truth, StandingTracksHoldTheirLastKeyAndMovingOnesAreOnTheWayBetween) {
  const auto second = [](int s) { return fromNanoseconds(s * 1'000'000'000LL); };
  TruthTrack track = standing(1, {1, 0, 0});
  track.keys.push_back({second(10), {5, 0, 0}, 0.0});
  track.present_until = second(20);
  EXPECT_EQ(track.at(second(9))->centre_W.x(), 1.0);
  EXPECT_EQ(track.at(second(10))->centre_W.x(), 5.0);
  EXPECT_FALSE(track.at(second(20)));
  track.moves = true;
  EXPECT_NEAR(track.at(second(5))->centre_W.x(), 3.0, 1e-9);
  EXPECT_EQ(track.at(second(10))->centre_W.x(), 5.0);
  EXPECT_FALSE(track.at(second(11)));
}

TEST(Truth, OfASimulationIsLaidToTheFirstPoseByYawAndPosition) {
  const double turn = 0.7;
  const RigidTransform T_WT(rotationAboutZ(turn), Eigen::Vector3d(3, -2, 1));
  std::vector<replay::StampedPose> body;
  StampedPoses poses;
  for (int i = 0; i < 5; ++i) {
    const RigidTransform T_TB(expSo3(Eigen::Vector3d(0.05, 0.02, 0.3)), Eigen::Vector3d(i, 2, 1));
    const TimePoint time = fromNanoseconds(1'000'000'000LL * (i + 1));
    body.push_back({time, T_TB});
    if (i > 0) poses[static_cast<std::uint64_t>(i)] = {time, T_WT * T_TB};
  }
  sim::Truth truth;
  truth.objects.resize(1);
  truth.objects[0].keys.resize(1);
  truth.objects[0].keys[0].centre_W = {10, 4, 0.7};
  truth.objects[0].keys[0].yaw = 0.2;
  const auto picture =
      truthOfSimulation(truth, replay::PoseFile(replay::PoseFormat::kTum, body), poses);
  ASSERT_THAT(picture.objects, SizeIs(1));
  const auto& key = picture.objects[0].keys[0];
  EXPECT_LT((key.centre_W - T_WT * Eigen::Vector3d(10, 4, 0.7)).norm(), 1e-9);
  EXPECT_NEAR(key.yaw, 0.2 + turn, 1e-9);
  ASSERT_THAT(picture.path, SizeIs(4));
  EXPECT_LT((picture.path.at(4) - poses[4].T_WB.p).norm(), 1e-9);
}

TEST(Truth, IsTurnedWithItsYaws) {
  PictureTruth truth;
  truth.objects = {standing(1, {2, 0, 0})};
  truth.path[3] = {1, 0, 0};
  const RigidTransform T_MW(rotationAboutZ(0.5 * std::numbers::pi), Eigen::Vector3d(10, 0, 0));
  const PictureTruth there = turned(T_MW, truth);
  EXPECT_LT((there.objects[0].keys[0].centre_W - Eigen::Vector3d(10, 2, 0)).norm(), 1e-12);
  EXPECT_NEAR(there.objects[0].keys[0].yaw, 0.5 * std::numbers::pi, 1e-12);
  EXPECT_LT((there.path.at(3) - Eigen::Vector3d(10, 1, 0)).norm(), 1e-12);
}

TEST(Truth, OfLabelsStandsInTheWorldWhereverTheBodyIs) {
  Eigen::Matrix3d R_RI;  // camera 0 looks along the body's x
  R_RI << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const RigidTransform T_RI(R_RI, Eigen::Vector3d::Zero());
  const Eigen::Vector3d car(20, 3, 0.5);
  std::vector<replay::KittiLabel> labels;
  StampedPoses poses;
  for (std::uint64_t i = 0; i < 10; ++i) {
    const RigidTransform T_WB(rotationAboutZ(0.1 * static_cast<double>(i)),
                              Eigen::Vector3d(static_cast<double>(i), 0, 0));
    poses[i] = {fromNanoseconds(static_cast<std::int64_t>(i) * 100'000'000), T_WB};
    replay::KittiLabel label;
    label.frame = i;
    label.track = 4;
    label.type = i == 9 ? "Pedestrian" : "Car";
    label.track = i == 9 ? 5 : 4;
    label.length = 4, label.width = 1.6, label.height = 1.5;
    label.centre = T_RI * (T_WB.inverse() * car);
    // A car that heads 0.3 rad left of x in W: rotation_y is 0 to the right and -pi/2 ahead.
    label.rotation_y = -std::numbers::pi / 2 - (0.3 - 0.1 * static_cast<double>(i));
    labels.push_back(label);
  }
  const auto truth = truthOfLabels(labels, T_RI, poses);
  ASSERT_THAT(truth.objects, SizeIs(2));
  EXPECT_EQ(truth.objects[0].class_name, "car");
  EXPECT_EQ(truth.objects[1].class_name, "person");
  EXPECT_FALSE(truth.objects[0].moves);
  ASSERT_THAT(truth.objects[0].keys, SizeIs(1));
  EXPECT_LT((truth.objects[0].keys[0].centre_W - car).norm(), 1e-9);
  EXPECT_NEAR(truth.objects[0].keys[0].yaw, 0.3, 1e-9);
}

}  // namespace
}  // namespace perdure::tools

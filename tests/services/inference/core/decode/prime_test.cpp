// Tests top-down answers: which candidate answers which expectation, and with what evidence.
#include "services/inference/core/decode/prime.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/inference/core/decode/evidence.h"

namespace perdure::inference {
namespace {

Candidate candidate(const Box& box, float car, float van = -9.0F) {
  Candidate c;
  c.box = box;
  c.activations = {0.0F, car, van};
  return c;
}

Expectation expectation(const Box& box, std::size_t activation = 1) {
  return {box, activation, {2.0, 2.0, 2.0, 2.0}};
}

const Calibration kEven{.temperature = 1.0, .clutter_rate = 0.5};
const Box kPlace{100, 100, 140, 130}, kElsewhere{300, 100, 340, 130};

TEST(Prime, AsksOnlyWhereNoReportedBoxIs) {
  const auto answers = prime(kEven, {expectation(kPlace), expectation(kElsewhere)},
                             {candidate({101, 101, 141, 131}, 2.0F)}, {});
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].expectation, 1U);
  EXPECT_FALSE(answers[0].candidate);
}

TEST(Prime, OneReportedBoxMeetsOneOfTwoThingsInLine) {
  const Box behind{108, 98, 148, 128};
  const auto answers = prime(kEven, {expectation(kPlace), expectation(behind)},
                             {candidate({101, 100, 141, 130}, 3.0F)},
                             {candidate({101, 100, 141, 130}, 3.0F), candidate(behind, -1.0F)});
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].expectation, 1U);
  ASSERT_TRUE(answers[0].candidate);
  EXPECT_EQ(*answers[0].candidate, 1U) << "the other one is the nearer thing's";
}

TEST(Prime, OfTwoCandidatesTheLikelierByActivationAndPlaceWins) {
  const std::vector<Candidate> two = {candidate({108, 105, 148, 135}, -1.0F),
                                      candidate({101, 100, 141, 130}, -2.0F)};
  const auto answers = prime(kEven, {expectation(kPlace)}, {}, two);
  ASSERT_TRUE(answers.at(0).candidate);
  EXPECT_EQ(*answers[0].candidate, 1U) << "the stronger one lies 8 pixels off";
  EXPECT_LT(answers[0].odds, -2.0);
  EXPECT_GT(answers[0].odds, -2.2) << "one pixel off costs little";
}

TEST(Prime, TheActivationOfTheExpectedClassCounts) {
  const std::vector<Candidate> two = {candidate(kPlace, -1.0F, -6.0F),
                                      candidate(kPlace, -5.0F, -2.0F)};
  EXPECT_EQ(*prime(kEven, {expectation(kPlace, 1)}, {}, two).at(0).candidate, 0U);
  EXPECT_EQ(*prime(kEven, {expectation(kPlace, 2)}, {}, two).at(0).candidate, 1U);
}

TEST(Prime, WhatBelongsToAStrangersBoxDoesNotSpeakForAGhostBesideIt) {
  const Box stranger{112, 100, 152, 130};  // a reported box without an expectation
  const auto answers = prime(kEven, {expectation(kPlace)}, {candidate(stranger, 4.0F)},
                             {candidate({111, 100, 151, 130}, 3.0F)});
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_FALSE(answers[0].candidate);
}

TEST(Prime, EvidenceIsTheFittedLineAndBounded) {
  const PrimedCalibration fitted{.floor = 0.002, .slope = 0.5, .offset = 2.0, .nothing = -0.75};
  EXPECT_DOUBLE_EQ(primedLogRatio(fitted, {0, 3, -2.0}), 1.0);
  EXPECT_DOUBLE_EQ(primedLogRatio(fitted, {0, std::nullopt, 0.0}), -0.75);
  EXPECT_DOUBLE_EQ(primedLogRatio(fitted, {0, 3, 1e6}), 5.0);
  EXPECT_DOUBLE_EQ(primedLogRatio(fitted, {0, 3, -1e6}), -5.0);
}

TEST(Prime, AFusedPlaceLiesBetweenAndNearerToTheSurerOne) {
  Expectation e = expectation({100, 100, 140, 130});
  const Candidate c = candidate({110, 100, 150, 130}, 0.0F);
  e.side_sigma = {0.1, 0.1, 0.1, 0.1};
  EXPECT_NEAR(fused(e, c).box.x1, 100.0, 0.1);
  e.side_sigma = {50.0, 50.0, 50.0, 50.0};
  EXPECT_NEAR(fused(e, c).box.x1, 110.0, 0.1);
  EXPECT_LT(fused(e, c).side_sigma[0], 1.0 + 0.07 * 40.0);
}

TEST(Prime, PredictionsAreOfThisCameraAndSourceAndFresh) {
  Frame frame;
  frame.camera = "cam0";
  frame.stamp.source = 3;
  frame.stamp.time = TimePoint(std::chrono::seconds(10));
  Predictions p;
  p.camera = "cam0";
  p.stamp = frame.stamp;
  p.stamp.time = TimePoint(std::chrono::milliseconds(9800));
  EXPECT_TRUE(fitsFrame(p, frame));
  p.stamp.time = TimePoint(std::chrono::milliseconds(9400));
  EXPECT_FALSE(fitsFrame(p, frame)) << "too old";
  p.stamp.time = TimePoint(std::chrono::milliseconds(10100));
  EXPECT_FALSE(fitsFrame(p, frame)) << "of a later frame";
  p.stamp.time = frame.stamp.time;
  p.camera = "cam1";
  EXPECT_FALSE(fitsFrame(p, frame));
  p.camera = "cam0";
  p.stamp.source = 4;
  EXPECT_FALSE(fitsFrame(p, frame));
}

TEST(Prime, ABoxMovesOnAsPredicted) {
  const Prediction p{1, "car", {10, 20, 30, 40}, 0.9, {100, 0, 50, -20}, {}};
  const Box b = movedOn(p, 0.1);
  EXPECT_DOUBLE_EQ(b.x1, 20.0);
  EXPECT_DOUBLE_EQ(b.x2, 35.0);
  EXPECT_DOUBLE_EQ(b.y2, 38.0);
}

}  // namespace
}  // namespace perdure::inference

#include "services/semantic_filter/core/tracks/initiation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/semantic_filter/core/association/score.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::detect;
using testing::makeState;

/// Two cars in a row along the street. The network's box of the far car is the part that the near
/// car does not hide.
class InitiationInARow : public ::testing::Test, protected testing::UsualFrame {
 protected:
  InitiationInARow() {
    frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
    std::mt19937 random(1);
    for (const State& x : {near_, far_}) {
      Detection d = *detect({x, "car"}, frame.view, parameters.box, 0.0, 3.0, random);
      if (!boxes_.empty()) d.box.x1 = boxes_.front().z.sides[2];
      boxes_.push_back(
          *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {}));
    }
  }

  /// Range and deviation, m, of the car that the second box initiates.
  std::pair<double, double> born() const {
    const auto track = initiate(boxes_[1], std::nullopt, {}, frame);
    double mean = 0.0, square = 0.0, weight = 0.0;
    for (const Hypothesis& h : track->hypotheses) {
      if (h.class_name != "car") continue;
      mean += h.weight * h.x[0];
      square += h.weight * (h.x[0] * h.x[0] + h.P(0, 0));
      weight += h.weight;
    }
    mean /= weight;
    return {mean, std::sqrt(square / weight - mean * mean)};
  }

  const State near_ = makeState(18.0, 3.5, 0.75, 0.0, 4.2, 1.75, 1.5);
  const State far_ = makeState(24.0, 3.5, 0.75, 0.0, 4.2, 1.75, 1.5);
  std::vector<BoxDetection> boxes_;
};

TEST_F(InitiationInARow, APartThatEndsAtANearerCarIsNotTakenForAWholeOneFartherAway) {
  const auto [whole, whole_sigma] = born();
  markSidesBesideNearer(boxes_, frame.view);
  ASSERT_TRUE(boxes_[1].beside_nearer[0]);
  const auto [part, part_sigma] = born();
  EXPECT_LT(std::abs(part - 24.0), 0.5 * std::abs(whole - 24.0));
  EXPECT_LT(std::abs(part - 24.0), part_sigma);
}

TEST_F(InitiationInARow, TheUpdateDoesNotCompareASideAtANearerCar) {
  const Track near = testing::makeObject(1, "car", near_, 0.01);
  const TrackVisibility all{.state = Visibility::kVisible, .fraction = 1.0};
  const TrackScore score = scoreTrack(near, all, boxes_, frame);
  EXPECT_EQ(hiddenSides(score, 0, boxes_[0]), (std::array<bool, 4>{}));
  boxes_[0].beside_nearer = {false, false, true, false};
  EXPECT_EQ(hiddenSides(score, 0, boxes_[0]), boxes_[0].beside_nearer);
}

// The score of a network for 80 classes contains the share of the class, as that for four does.
// Without the factor of the number of classes the evidence would fall by log(80 / 4) = 3.
TEST_F(InitiationInARow, ClassesThatTheNetworkExcludesDoNotLowerTheEvidenceOfABox) {
  const double of_four = logInitiationRatio(boxes_[0], frame);
  ModelInfo info = testing::makeModelInfo();
  std::vector<double> ratios(boxes_[0].log_ratio.begin(), boxes_[0].log_ratio.end());
  for (int i = 0; i < 76; ++i) {
    info.classes.push_back("car");
    info.classes.back() += std::to_string(i);
    priors.classes.push_back(testing::makePrior(info.classes.back(), 4.2, 1.75, 1.5, 0.1));
    ratios.push_back(-8.0);
  }
  model = makeModel(info);
  boxes_[0].log_ratio = ratios;
  EXPECT_NEAR(logInitiationRatio(boxes_[0], frame), of_four, 0.3);
}

}  // namespace
}  // namespace perdure::semantic_filter

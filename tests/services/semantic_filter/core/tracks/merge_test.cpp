#include "services/semantic_filter/core/tracks/merge.h"

#include <gtest/gtest.h>

#include "services/semantic_filter/core/smoothing/batch_problem.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

class Merge : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(Merge, OverlapIsSharedOverJointVolume) {
  const State a = makeState(0, 0, 0, 0, 4, 2, 1.5);
  EXPECT_NEAR(overlap(a, a, Eigen::Vector3d::UnitZ()), 1.0, 1e-12);
  EXPECT_NEAR(overlap(a, makeState(2, 0, 0, M_PI, 4, 2, 1.5), Eigen::Vector3d::UnitZ()), 1.0 / 3.0,
              1e-9);
  EXPECT_EQ(overlap(a, makeState(0, 0, 2, 0, 4, 2, 1.5), Eigen::Vector3d::UnitZ()), 0.0);
}

TEST_F(Merge, ACopyThatItsOriginalHidesIsMerged) {
  std::vector<Track> objects = {
      makeObject(2, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004),
      makeObject(5, "car", makeState(10.3, 0, 0.7, 0, 4, 1.8, 1.5), 0.004)};
  objects[1].visibility.fraction = 0.0;
  objects[1].visibility.state = Visibility::kOccluded;
  objects[1].visibility.blocked_by = 7;  // occluded by another object: not yet
  EXPECT_TRUE(mergeObjects(objects, frame).empty());
  objects[1].visibility.blocked_by = 2;
  const auto merges = mergeObjects(objects, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 2u);
  EXPECT_EQ(merges[0].absorbed, 5u);
}

TEST_F(Merge, OfTwoTracksOfOneClassInOnePlaceTheOlderSurvives) {
  std::vector<Track> objects = {
      makeObject(5, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.004),
      makeObject(2, "car", makeState(10.3, 0, 0.7, 0, 4, 1.8, 1.5), 0.004)};
  const auto merges = mergeObjects(objects, frame);
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].survivor, 2u);
  EXPECT_EQ(merges[0].absorbed, 5u);
  ASSERT_EQ(objects.size(), 1u);
  EXPECT_EQ(objects[0].id, 2u);
  EXPECT_EQ(objects[0].life.hits, 8u);
  EXPECT_NEAR(objects[0].best().x[0], 10.15, 0.01);
  EXPECT_GE(objects[0].existence, 0.9);
}

/// One frame for each letter of `pattern`, with two visible tracks: "a" or "b" was detected, "+"
/// both, "-" neither.
void computeVisibility(std::vector<Track>& two, const std::string& pattern) {
  for (const char c : pattern) {
    two[0].history.add(true, c == 'a' || c == '+');
    two[1].history.add(true, c == 'b' || c == '+');
  }
}

TEST_F(Merge, TracksThatOverlapALittleAndAreNeverDetectedTogetherAreOne) {
  const auto merged = [&](double apart_m, const std::string& pattern) {
    std::vector<Track> objects = {
        makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.1),
        makeObject(2, "car", makeState(10 + apart_m, 0, 0.7, 0, 4, 1.8, 1.5), 0.1)};
    computeVisibility(objects, pattern);
    return mergeObjects(objects, frame).size() == 1;
  };
  const double little = 3.0, touching = 3.8;  // IoU of 1/7 and of 1/39
  EXPECT_TRUE(merged(little, "abba"));
  EXPECT_TRUE(merged(little, "-a-b--aaa"));
  EXPECT_FALSE(merged(little, "abb-")) << "too few";
  EXPECT_FALSE(merged(little, "abbaab+")) << "two boxes of one frame are of two objects";
  EXPECT_FALSE(merged(touching, "abbaabba"));
  EXPECT_TRUE(merged(1.0, "----"));
  EXPECT_FALSE(merged(1.1, "ab+")) << "two objects that touch, badly placed";
  EXPECT_TRUE(merged(0.3, "ab+")) << "two boxes of one object, as networks make them";
}

TEST_F(Merge, FramesInWhichOneIsNotVisibleDoNotCount) {
  std::vector<Track> objects = {makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.1),
                                makeObject(2, "car", makeState(13, 0, 0.7, 0, 4, 1.8, 1.5), 0.1)};
  for (int i = 0; i < 20; ++i) {
    objects[0].history.add(i < 10, i < 10);
    objects[1].history.add(i >= 10, i >= 10);
  }
  EXPECT_TRUE(mergeObjects(objects, frame).empty());
}

TEST_F(Merge, ContradictingTracksKeepTheHypothesesOfBoth) {
  // The mean of two cuboids with different yaws is not the cuboid of an object.
  std::vector<Track> objects = {
      makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.1),
      makeObject(2, "car", makeState(10, 0.1, 0.7, 0.5, 4, 1.8, 1.5), 0.1)};
  objects[0].life.hits = 3, objects[1].life.hits = 9;
  ASSERT_EQ(mergeObjects(objects, frame).size(), 1u);
  const Track& one = objects[0];
  EXPECT_EQ(one.id, 1u);
  EXPECT_EQ(one.life.hits, 12u);
  ASSERT_EQ(one.hypotheses.size(), 2u);
  EXPECT_NEAR(one.best().x[kYaw], 0.5, 1e-12) << "that which was found more often";
  EXPECT_NEAR(one.best().weight, 0.75, 1e-9);
  EXPECT_NEAR(one.hypotheses[1].x[kYaw], 0.0, 1e-12);
}

TEST_F(Merge, ATrackSeldomDetectedOfLateForgetsItsContradictingKeyframes) {
  const State was = makeState(24, 2, 0.7, 0.6, 4, 1.8, 1.5),
              is = makeState(20, 0, 0.7, 0, 4, 1.8, 1.5);
  const auto scoreHypothesis = [&](const State& x) {
    const auto p = projectCuboid(x, frame.view);
    Keyframe k;
    k.z = measure({p->sides[0], p->sides[1], p->sides[2], p->sides[3]}, camera.width(),
                  camera.height(), parameters.box);
    k.from = std::make_shared<const FrameView>(frame.view, PoseError{}, fromNanoseconds(1),
                                               std::make_shared<const BoxStyles>());
    return std::make_shared<const Keyframe>(k);
  };
  const auto rememberedOf = [&](double support_of_first, double support_of_second) {
    Track a = makeObject(1, "car", was, 0.01);
    Track b = makeObject(2, "car", is, 0.01);
    a.batch.keyframes = Keyframes{scoreHypothesis(was), scoreHypothesis(was), scoreHypothesis(is)};
    b.batch.keyframes = Keyframes{scoreHypothesis(is), scoreHypothesis(is)};
    a.history.recent_share = support_of_first, b.history.recent_share = support_of_second;
    mergeTwo(a, b, frame);
    EXPECT_EQ(a.hypotheses.size(), 2u) << "they contradict each other";
    return a.batch.keyframes.size();
  };
  EXPECT_EQ(rememberedOf(0.1, 0.9), 3u);
  EXPECT_EQ(rememberedOf(0.9, 0.9), 5u) << "both are detected: later observations decide";
  EXPECT_EQ(rememberedOf(0.9, 0.1), 3u)
      << "its keyframes are of the other object, and contradict the first";
}

TEST_F(Merge, OneObservationDoesNotOverruleManyKeyframes) {
  // A toy that leaves the image, and the car that its partial view resembles.
  const State toy = makeState(1.4, -0.4, 1.3, 0, 0.4, 0.2, 0.15);
  const State car = makeState(1.6, -0.4, 1.5, 0, 4, 1.8, 1.5);
  const auto merged = [&](std::uint32_t toy_hits, std::uint32_t car_hits) {
    std::vector<Track> objects = {makeObject(1, kOtherClass, toy, 1e-4),
                                  makeObject(2, "car", car, 0.01)};
    objects[0].life.confirmed = objects[0].life.once_confirmed = true;
    objects[0].life.hits = toy_hits, objects[1].life.hits = car_hits;
    EXPECT_EQ(mergeObjects(objects, frame).size(), 1u);
    EXPECT_EQ(objects[0].id, 1u);
    EXPECT_EQ(objects[0].life.hits, toy_hits + car_hits);
    return objects[0].best();
  };
  EXPECT_EQ(merged(345, 1).class_name, kOtherClass);
  EXPECT_EQ(merged(345, 1).x, toy);
  EXPECT_EQ(merged(5, 4).class_name, "car") << "it turned out to be one";
}

TEST_F(Merge, AChairUnderATableStaysTwoObjects) {
  std::vector<Track> objects = {
      makeObject(1, "dining table", makeState(3, 0, 0.4, 0, 1, 1.2, 0.75), 0.01),
      makeObject(2, "chair", makeState(3.1, 0.1, 0.45, 0, 0.9, 0.9, 0.9), 0.01)};
  EXPECT_TRUE(mergeObjects(objects, frame).empty());
  EXPECT_EQ(objects.size(), 2u);
}

TEST_F(Merge, InvisibleTracksAreNotMerged) {
  std::vector<Track> objects = {makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.01),
                                makeObject(2, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), 0.01)};
  objects[1].visibility.fraction = 0.0;
  EXPECT_TRUE(mergeObjects(objects, frame).empty());
}

/// A loop closure brings an object back to where a new track of it was left behind.
TEST_F(Merge, ATrackAndAnObjectOfTheMapInOnePlaceAreOneAlsoUnseen) {
  const auto merged = [&](bool recalled, double aside_m, double sigma_m) {
    std::vector<Track> objects = {
        makeObject(1, "car", makeState(10, 0, 0.7, 0, 4, 1.8, 1.5), sigma_m * sigma_m),
        makeObject(2, "car", makeState(10, aside_m, 0.7, 0, 4, 1.8, 1.5), 0.01)};
    for (Track& o : objects) o.visibility.fraction = 0.0;
    objects[0].life.recalled = recalled;
    return mergeObjects(objects, frame).size() == 1;
  };
  EXPECT_TRUE(merged(true, 0.4, 0.3));
  EXPECT_FALSE(merged(false, 0.4, 0.3));
  EXPECT_FALSE(merged(true, 1.9, 0.3)) << "they stand beside each other";
  EXPECT_FALSE(merged(true, 0.4, 2.0)) << "it may be the car beside it";
}

TEST_F(Merge, FusionCountsThePriorOnSizeOnce) {
  // Each belief is the size prior plus one observation with variance 0.02 in each dimension.
  const ClassPrior prior = priors.of("car");
  const double p = prior.log_size_covariance(0, 0), look = 0.02;
  const double one = 1.0 / (1.0 / p + 1.0 / look), both = 1.0 / (1.0 / p + 2.0 / look);
  Hypothesis a = makeObject(1, "car", State::Zero(), 0.5).best(), b = a;
  a.P.diagonal().segment<3>(kSize).setConstant(one);
  b.P = a.P;
  a.x.segment<3>(kSize) = b.x.segment<3>(kSize) = prior.log_size;
  const Hypothesis fused = fuse(a, b, prior, Matrix6d::Zero());
  EXPECT_NEAR(fused.P(kSize, kSize), both, 1e-9);
  EXPECT_NEAR(fused.P(0, 0), 0.25, 1e-9);
}

TEST_F(Merge, FusionCountsTheSharedPoseErrorOnce) {
  Matrix6d P_pose = Matrix6d::Zero();
  P_pose.diagonal() << 1e-6, 1e-6, 1e-6, 0.09, 0.09, 0.09;
  Hypothesis a = makeObject(1, "car", State::Zero(), 0.01).best();
  a.x.segment<3>(kSize) = priors.of("car").log_size;
  a.P.diagonal().segment<3>(kSize).setConstant(0.005);
  a.P.diagonal().head<3>().array() += 0.09;
  a.C.topRightCorner<3, 3>() = 0.09 * Eigen::Matrix3d::Identity();
  const Hypothesis fused = fuse(a, a, priors.of("car"), P_pose);
  EXPECT_NEAR(fused.P(0, 0), 0.09 + 0.005, 1e-6);
  EXPECT_NEAR(fused.C(0, 3), 0.09, 1e-6);
}

}  // namespace
}  // namespace perdure::semantic_filter

// Tracks that the map gives to the working set, and tracks that it holds to be one object.
#include "services/semantic_filter/core/arrivals.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/history.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makePriors;
using testing::makeState;

const State kPlace = makeState(12, 3, 0.75, 0.2, 4.2, 1.75, 1.5);

/// An arbitrary covariance of this size.
Matrix6d someCovariance(double variance) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const Matrix6d root = Matrix6d::NullaryExpr([&] { return normal(random); });
  return variance * (root * root.transpose() + Matrix6d::Identity());
}

/// An object as the map sends it, not detected on this visit.
ObjectBelief known(TrackId id, const State& x = kPlace, const std::string& name = "car") {
  Track track = makeObject(id, name, x, 0.04);
  track.life.confirmed = track.life.once_confirmed = true;
  return toBelief(track, makePriors(), 0.7);
}

Track seen(TrackId id, const State& x = kPlace, const std::string& name = "car") {
  Track track = makeObject(id, name, x, 0.04);
  track.life.confirmed = track.life.once_confirmed = true;
  return track;
}

class ArrivalsTest : public ::testing::Test {
 protected:
  ArrivalsTest() {
    input_.view = usual_.frame.view;
    input_.view.T_WB =
        RigidTransform(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())),
                       Eigen::Vector3d(4.0, -1.0, 1.2));
    input_.model = std::make_shared<const Model>(usual_.model);
    input_.pose_error.covariance = someCovariance(1e-3);
    input_.pose_error.product = 0.5 * Matrix6d::Identity();
  }
  std::vector<MergeRecord> takeIn() {
    return semantic_filter::takeIn(arrivals_, belief_, input_, filter_);
  }
  std::vector<TrackId> ids() const {
    std::vector<TrackId> all;
    for (const Track& t : belief_.tracks) all.push_back(t.id);
    return all;
  }

  testing::UsualFrame usual_;
  SemanticFilter filter_{usual_.parameters, usual_.priors};
  FrameInput input_;
  Belief belief_;
  Arrivals arrivals_;
};
using Ids = std::vector<TrackId>;

TEST_F(ArrivalsTest, APlacedTrackIsAsUncertainAsTheBodyAndSharesItsError) {
  arrivals_.placed = {known(7)};
  EXPECT_TRUE(takeIn().empty());
  ASSERT_EQ(ids(), Ids{7});
  const Track& track = belief_.tracks.front();
  EXPECT_TRUE(track.life.recalled);
  EXPECT_EQ(track.pose_product, input_.pose_error.product);
  // Numeric derivative: the object moves with the body.
  constexpr double kStep = 1e-6;
  const RigidTransform& T_WB = input_.view.T_WB;
  const Matrix6d& P = input_.pose_error.covariance;
  const Eigen::Vector3d p = kPlace.head<3>();
  Eigen::Matrix<double, 4, 6> A;
  for (int k = 0; k < 6; ++k) {
    RigidTransform moved = T_WB;
    if (k < 3) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      moved.q = moved.q * Eigen::Quaterniond(Eigen::AngleAxisd(kStep, axis));
    } else {
      moved.p[k - 3] += kStep;
    }
    A.col(k).head<3>() = (moved * (T_WB.inverse() * p) - p) / kStep;
    A(3, k) = wrapAngle(yawOf(moved.R()) - yawOf(T_WB.R())) / kStep;
  }
  for (const Hypothesis& h : track.hypotheses) {
    EXPECT_EQ(h.x.head<7>(), kPlace.head<7>());
    EXPECT_LT((h.C.topRows<4>() - A * P).norm(), 1e-4 * (A * P).norm());
    EXPECT_TRUE(h.C.bottomRows(h.C.rows() - 4).isZero());
    const Eigen::Matrix4d expected = 0.04 * Eigen::Matrix4d::Identity() + A * P * A.transpose();
    EXPECT_LT((h.P.topLeftCorner<4, 4>() - expected).norm(), 1e-4 * expected.norm());
    EXPECT_NEAR(h.P(5, 5), 0.04, 1e-12);
  }
}

TEST_F(ArrivalsTest, APublishedTrackKeepsEachBitAndTheProductOfItsTime) {
  ObjectBelief belief = known(7);
  const Matrix6d cross = someCovariance(1e-3);
  belief.classes.front().cross_pose.topRows<6>() = cross;
  const Matrix6d product = 0.25 * Matrix6d::Identity();
  arrivals_.as_published = {{belief, product}};
  EXPECT_TRUE(takeIn().empty());
  ASSERT_EQ(ids(), Ids{7});
  const Track& track = belief_.tracks.front();
  EXPECT_TRUE(track.life.recalled);
  EXPECT_EQ(track.pose_product, product);
  ASSERT_EQ(track.hypotheses.size(), 1u);
  EXPECT_EQ(track.best().x.head<7>(), belief.best().mean);
  const Matrix7d P = track.best().P.topLeftCorner<7, 7>();
  EXPECT_EQ(P, belief.best().covariance);
  EXPECT_EQ((track.best().C.topRows<7>()), belief.best().cross_pose);
  EXPECT_EQ(track.as_of, belief.as_of);
}

TEST_F(ArrivalsTest, ADetectedTrackStaysAndAnUnseenOneIsPlacedAgain) {
  State elsewhere = kPlace;
  elsewhere[0] += 1.0;
  belief_.tracks = {seen(3), seen(7)};
  belief_.tracks[1].life.recalled = true;
  arrivals_.placed = {known(3, elsewhere), known(7, elsewhere), known(5, elsewhere)};
  arrivals_.as_published = {{known(3, elsewhere), Matrix6d::Identity()}};
  EXPECT_TRUE(takeIn().empty());
  ASSERT_EQ(ids(), (Ids{3, 5, 7})) << "in order";
  EXPECT_EQ(belief_.tracks[0].best().x, kPlace);
  EXPECT_TRUE(belief_.tracks[0].best().C.isZero(0.0));
  EXPECT_EQ(belief_.tracks[2].best().x[0], elsewhere[0]);
}

TEST_F(ArrivalsTest, TwoTracksOfOneObjectAreFusedOnceAndTheDetectedOneGoesOn) {
  for (const auto& [detected, given] : {std::pair<TrackId, TrackId>{30, 7}, {7, 30}}) {
    belief_ = {};
    belief_.tracks = {seen(detected)};
    State beside = kPlace;
    beside[0] += 0.4;
    arrivals_.placed = {known(given, beside)};
    arrivals_.members = {{30, 7}};
    const auto fused = takeIn();
    ASSERT_EQ(fused.size(), 1u);
    EXPECT_EQ(fused[0].survivor, detected);
    EXPECT_EQ(fused[0].absorbed, given);
    EXPECT_TRUE(fused[0].by_map);
    ASSERT_EQ(ids(), Ids{detected});
    const Track once = belief_.tracks.front();
    Belief alone;
    (void)semantic_filter::takeIn(arrivals_, alone, input_, filter_);
    const Track track = alone.tracks.front();
    EXPECT_FALSE(once.life.recalled);
    EXPECT_LT(once.best().P(0, 0), track.best().P(0, 0)) << "than of the one that was given";
    EXPECT_GT(once.best().x[0], kPlace[0]);
    EXPECT_LT(once.best().x[0], beside[0]);
    EXPECT_TRUE(takeIn().empty()) << "the same state again";
    ASSERT_EQ(ids(), Ids{detected});
    EXPECT_EQ(belief_.tracks.front().best().x, once.best().x);
    EXPECT_EQ(belief_.tracks.front().best().P, once.best().P);
    EXPECT_EQ(belief_.tracks.front().existence, once.existence);
  }
}

TEST_F(ArrivalsTest, TracksOfAThirdOneAreFusedToo) {
  belief_.tracks = {seen(20), seen(30)};
  arrivals_.placed = {known(7)};
  arrivals_.members = {{20, 7}, {30, 7}};
  EXPECT_EQ(takeIn().size(), 2u);
  EXPECT_EQ(ids(), Ids{20});
  EXPECT_TRUE(takeIn().empty());
  EXPECT_EQ(ids(), Ids{20});
}

TEST_F(ArrivalsTest, AFusedTrackComesBackIfItIsAnotherObjectAfterAll) {
  belief_.tracks = {seen(30)};
  arrivals_.placed = {known(7)};
  arrivals_.members = {{30, 7}};
  ASSERT_EQ(takeIn().size(), 1u);
  arrivals_.members.clear();
  EXPECT_TRUE(takeIn().empty());
  EXPECT_EQ(ids(), (Ids{7, 30}));
  arrivals_.members = {{30, 7}};
  EXPECT_EQ(takeIn().size(), 1u) << "it is the same object again";
  EXPECT_EQ(ids(), Ids{30});
}

TEST_F(ArrivalsTest, AFusedTrackComesBackOnceTheOtherHasLeft) {
  belief_.tracks = {seen(30)};
  arrivals_.placed = {known(7)};
  arrivals_.members = {{30, 7}};
  ASSERT_EQ(takeIn().size(), 1u);
  belief_.tracks.clear();
  EXPECT_TRUE(takeIn().empty());
  EXPECT_EQ(ids(), Ids{7});
}

TEST_F(ArrivalsTest, OfTwoKindsTheUnseenOneLeavesAndTwoDetectedOnesStay) {
  belief_.tracks = {seen(30)};
  arrivals_.placed = {known(7, kPlace, "van")};
  arrivals_.members = {{30, 7}};
  const auto left = takeIn();
  EXPECT_EQ(ids(), Ids{30});
  EXPECT_EQ(belief_.tracks.front().best().x, kPlace);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].survivor, 30u);
  EXPECT_EQ(left[0].absorbed, 7u);
  EXPECT_TRUE(left[0].by_map);
  takeIn();
  EXPECT_EQ(ids(), Ids{30});
  EXPECT_EQ(belief_.tracks.front().best().x, kPlace);

  belief_.tracks = {seen(7, kPlace, "van"), seen(30)};
  EXPECT_TRUE(takeIn().empty());
  EXPECT_EQ(ids(), (Ids{7, 30}));
}

TEST_F(ArrivalsTest, ATrackHasItsOwnIdUnlessItIsAMember) {
  arrivals_.members = {{30, 7}};
  EXPECT_EQ(arrivals_.objectOf(30), 7u);
  EXPECT_EQ(arrivals_.objectOf(7), 7u);
  EXPECT_EQ(arrivals_.objectOf(31), 31u);
}

/// Frames from one place; the map gives an object before the fifth frame.
class SteppedAgain {
 public:
  explicit SteppedAgain(std::set<std::size_t> late) : late_(std::move(late)) {
    Arrivals arrivals;
    State beside = kPlace;
    beside[0] += 0.3;
    arrivals.placed = {known(50, beside), known(60, makeState(-9, 2, 0.75, 0, 4, 1.75, 1.5))};
    arrivals.members = {{1, 50}};
    for (std::size_t k = 0; k < 12; ++k) {
      HistoryFrame& frame = history_.add(testing::odometryAt(k, testing::driveTo(k, 0.1)), camera_);
      frame.input.model = model_;
      if (!late_.contains(k)) frame.input.boxes = boxesAt(frame.input.view, k);
      if (k == 5) history_.arrive(std::make_shared<const Arrivals>(arrivals));
      history_.step();
      merges_ += frame.merges.size();
    }
    for (const std::size_t k : late_) {
      HistoryFrame& frame = history_.frames()[k];
      frame.input.boxes = boxesAt(frame.input.view, k);
      history_.stepAgainFrom(k);
    }
  }
  const Belief& belief() const { return history_.belief(); }
  History& history() { return history_; }
  std::size_t merges() const { return merges_; }

 private:
  std::vector<BoxDetection> boxesAt(const View& view, std::size_t k) const {
    std::mt19937 random(static_cast<std::uint32_t>(k));
    const auto d = testing::detect({kPlace, "car"}, view, parameters_.box, 0.5, 3.0, random);
    return {*makeBoxDetection(*d, *model_, camera_->width(), camera_->height(), parameters_.box,
                              parameters_.clutter)};
  }

  std::set<std::size_t> late_;
  Parameters parameters_;
  ReasonCounts reasons_;
  std::shared_ptr<const CameraModel> camera_ =
      std::make_shared<const CameraModel>(testing::makeCamera());
  std::shared_ptr<const Model> model_ =
      std::make_shared<const Model>(makeModel(testing::makeModelInfo()));
  History history_{parameters_, makePriors(), 20, reasons_};
  std::size_t merges_ = 0;
};

TEST(ArrivalsHistory, WhatHasLeftDoesNotArriveAgain) {
  SteppedAgain run({});
  run.history().erase({60});
  run.history().stepAgainFrom(3);
  ASSERT_EQ(run.belief().tracks.size(), 1u);
  EXPECT_EQ(run.belief().tracks[0].id, 1u);
  run.history().erase({1});
  run.history().stepAgainFrom(3);
  for (const Track& track : run.belief().tracks) {
    EXPECT_NE(track.id, 1u);
    EXPECT_NE(track.id, 50u) << "it was fused with track 1";
  }
}

TEST(ArrivalsHistory, AFrameThatIsSteppedAgainTakesTheSameArrivalsInAgain) {
  const SteppedAgain on_time({});
  EXPECT_EQ(on_time.merges(), 1u);
  ASSERT_EQ(on_time.belief().tracks.size(), 2u);
  EXPECT_EQ(on_time.belief().tracks[0].id, 1u);
  EXPECT_EQ(on_time.belief().tracks[1].id, 60u);
  for (const std::set<std::size_t>& late : {std::set<std::size_t>{3}, {5}, {7}, {2, 5, 6, 11}}) {
    const SteppedAgain again(late);
    ASSERT_EQ(again.belief().tracks.size(), 2u);
    for (std::size_t j = 0; j < 2; ++j) {
      const Track &a = on_time.belief().tracks[j], &b = again.belief().tracks[j];
      EXPECT_EQ(a.id, b.id);
      EXPECT_EQ(a.existence, b.existence);
      EXPECT_EQ(a.life.hits, b.life.hits);
      ASSERT_EQ(a.hypotheses.size(), b.hypotheses.size());
      EXPECT_EQ(a.best().x, b.best().x);
      EXPECT_EQ(a.best().P, b.best().P);
      EXPECT_EQ(a.best().C, b.best().C);
    }
  }
}

}  // namespace
}  // namespace perdure::semantic_filter

// The search for the body among objects of an earlier visit, where the odometry erred more than its
// covariance says.
#include "common/mapping/loop_search.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "tests/common/mapping/synthetic_drive.h"

namespace perdure::mapping {
namespace {

using namespace test;

/// A straight drive there and back. The body detects objects of its start again, as new ones, at
/// places that are displaced by the error of the odometry.
class Return {
 public:
  explicit Return(const Eigen::Vector3d& error, ObjectId objects = 10)
      : state_(parameters_, {}), way_(parameters_.anchor) {
    for (int i = 0; i <= 300; ++i) drive(i <= 150 ? i : 300 - i, i <= 150 ? 0.0 : kPi);
    relative_ = std::make_unique<Marginals>(state_.graph(), way_.last()->id);
    const LevelPose here = state_.graph().pose(way_.last()->id);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-20.0, 20.0);
    for (ObjectId id = 1; id <= objects; ++id) {
      const Eigen::Vector3d p(any(random), any(random), 0.5);
      put(id, {1, placed(id, p)}, 0.0);
      put(id + 100, {way_.last()->id, placed(id + 100, here.inverse() * (p + error))},
          way_.way_m());
    }
  }

  std::optional<LoopSearch::Found> find(double widening) const {
    const Whereabouts body{state_, way_, *relative_, widening};
    return LoopSearch(parameters_).nearby(body);
  }
  LevelPose byOdometry() const { return state_.graph().pose(way_.last()->id); }

 private:
  void drive(double x, double yaw) {
    Odometry o;
    o.stamp.sequence = ++sequence_;
    o.world = kWorld;
    o.state = OdometryState::kTracking;
    o.T_WB = RigidTransform(rotationAboutZ(yaw), {x, 0.0, 0.0});
    if (const auto anchor = way_.add(o, state_.nextAnchor())) state_.add(*anchor);
  }
  PlacedObject placed(ObjectId id, const Eigen::Vector3d& p) {
    PlacedObject object;
    object.id = id;
    object.p = p;
    object.covariance = 0.04 * Eigen::Matrix4d::Identity();
    object.pmf = {{state_.numberOf("car"), 1.0}};
    return object;
  }
  void put(ObjectId id, const Sighting& sighting, double way_m) {
    ObjectRecord record;
    record.confirmed = true;
    record.session = kWorld;
    record.way_m = way_m;
    record.sighting = sighting;
    state_.put(id, std::move(record));
  }

  Parameters parameters_;
  MapState state_;
  AnchorBuilder way_;
  std::unique_ptr<Marginals> relative_;
  std::uint64_t sequence_ = 0;
};

TEST(LoopSearch, FindsTheBodyBeyondItsGateOnlyInAWiderRegion) {
  const Eigen::Vector3d error(8.0, -6.0, 0.0);
  const Return back(error);
  EXPECT_FALSE(back.find(1.0));
  const auto found = back.find(6.0);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->match.pairs.size(), 10u);
  const Eigen::Vector3d moved = found->match.T_MB.mean.p - back.byOdometry().p;
  EXPECT_LT((moved + error).head<2>().norm(), 0.3) << moved.transpose();
  EXPECT_GT(found->sigma_m, 1.5) << "the conditions are those of the larger deviation";
}

TEST(LoopSearch, FindsTheSameInBothRegionsWhereTheErrorIsSmall) {
  const Return back({0.3, 0.2, 0.0});
  const auto narrow = back.find(1.0), wide = back.find(4.0);
  ASSERT_TRUE(narrow && wide);
  EXPECT_EQ(narrow->match.pairs, wide->match.pairs);
}

/// Few objects suffice if they agree with a well known position, but not to contradict it.
TEST(LoopSearch, AMatchFarFromAWellKnownPositionNeedsMoreEvidence) {
  const double sigma_m = Return(Eigen::Vector3d::Zero()).find(1.0)->sigma_m;
  ASSERT_LT(sigma_m, Parameters().loop.near_m);
  const Eigen::Vector3d across = sigma_m * Eigen::Vector3d::UnitY();
  EXPECT_TRUE(Return(3.0 * across, 2).find(1.0));
  EXPECT_FALSE(Return(3.3 * across, 2).find(1.0));
  EXPECT_TRUE(Return(3.3 * across, 3).find(1.0));
}

}  // namespace
}  // namespace perdure::mapping

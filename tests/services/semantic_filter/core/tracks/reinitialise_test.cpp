#include <gtest/gtest.h>

#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/filter.h"
#include "services/semantic_filter/core/tracks/initiation.h"
#include "services/semantic_filter/core/tracks/mixture_reduction.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeObject;
using testing::makeState;

class Reinitialise : public ::testing::Test, protected testing::UsualFrame {};

TEST_F(Reinitialise, ATrackWithoutPlausibleSizeStartsAgainFromItsAssignedBoxWithItsClass) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  const State truth = makeState(14.0, 3.0, 0.75, 0.6, 4.2, 1.75, 1.5);
  const auto s = projectCuboid(truth, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 1.5F, -2, -2, 2};  // this box resembles a van more
  const auto e = *makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box, {});

  Track o = makeObject(7, "car", makeState(7.0, 1.5, 0.9, 0.6, 2.1, 0.87, 0.75), 0.001);
  o.life.once_confirmed = true;
  o.life.hits = 40;
  const double existence = o.existence;
  const auto pmf = classShares(o);
  reduceMixture(o, frame);
  ASSERT_TRUE(o.hypotheses.empty());
  ASSERT_TRUE(reinitialise(o, pmf, e, std::nullopt, frame));
  EXPECT_EQ(o.id, 7u);
  EXPECT_EQ(o.life.hits, 40u);
  EXPECT_EQ(o.existence, existence);
  EXPECT_NEAR(classProbability(o, "car"), 1.0, 1e-12);
  EXPECT_LT((o.best().x - truth).head<3>().norm(), 2.0);
  EXPECT_NEAR(o.best().x[kSize + 2], std::log(1.5), 0.1);
  EXPECT_GT(placeSigma(o.best(), Matrix6d::Zero()), 0.5)
      << "the place is known as by one observation";

  // An *other* track takes the class of the box.
  o.hypotheses.clear();
  ASSERT_TRUE(reinitialise(o, {{kOtherClass, 1.0}}, e, std::nullopt, frame));
  EXPECT_GT(classProbability(o, "van"), classProbability(o, "car"));
}

TEST_F(Reinitialise, OneBoxDoesNotReinitialiseAConfirmedTrackAtRest) {
  frame.view.T_WB = RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1.2));
  const Eigen::Vector3d size = priors.of("car").log_size;
  const Eigen::Vector3d sigma = priors.of("car").log_size_covariance.diagonal().cwiseSqrt();
  State x = makeState(14.0, 1.0, 0.75, 1.2, 4.2, 1.75, 1.5);
  x.segment<3>(kSize) << size[0] - 3.5 * sigma[0], size.tail<2>();
  Track car = makeObject(3, "car", x, 0.05);
  car.existence = {0.99, ExistenceEvidence::kPrior, car.as_of};
  car.life.hits = 30;
  car.life.first_seen = car.life.last_seen = car.as_of = testing::stampOf(0).time;
  State shown = x;  // an unmapped occluder hides one of its ends
  shown[kSize] -= 0.3;
  const auto s = projectCuboid(shown, frame.view)->sides;
  Detection d;
  d.box = {s[0], s[1], s[2], s[3]};
  d.activations = {0, 4, -2, -2, -2};

  const auto after = [&](bool claimed) {
    Belief belief{{car}, {}};
    belief.tracks[0].life.confirmed = belief.tracks[0].life.once_confirmed = claimed;
    FrameInput input;
    input.stamp = testing::stampOf(1);
    input.view = frame.view;
    input.model = std::make_shared<const Model>(model);
    input.boxes = {{*makeBoxDetection(d, model, camera.width(), camera.height(), parameters.box,
                                      parameters.clutter)}};
    IdBook ids;
    ids.atLeast(10);
    SemanticFilter(parameters, priors).step(belief, input, ids);
    return belief.tracks.at(0);
  };
  const Track guess = after(false);
  ASSERT_EQ(guess.id, 3u);
  EXPECT_GT((guess.best().x - x).head<3>().norm(), 0.5) << "begins again from that box";
  const Track o = after(true);
  ASSERT_EQ(o.id, 3u);
  EXPECT_LT((o.best().x - x).head<3>().norm(), 1e-3);
  EXPECT_LT(o.existence, 0.99);
  EXPECT_EQ(o.life.hits, 30u);
  EXPECT_EQ(o.life.visible_misses, 1u);
}

}  // namespace
}  // namespace perdure::semantic_filter


#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/smoothing/map_fit.h"
#include "services/semantic_filter/core/smoothing/refit.h"
#include "services/semantic_filter/core/tracks/lifecycle.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter {
namespace {

using testing::makeCamera;
using testing::makePrior;
using testing::makePriors;
using testing::makeState;

/// A car (or what drives as one) that is passed; boxes drawn from the model that is estimated with.
class Passing {
 public:
  explicit Passing(unsigned seed, double speed = 0.0, double pose_sigma = 0.0)
      : camera_(makeCamera()), random_(seed), priors_(makePriors()) {
    for (auto& c : priors_.classes) c.moving = 0.2, c.speed_sigma = 8.0, c.stands = 0.97;
    parameters_.smoothing.new_view = 0.01;
    truth_ = makeState(32.0, 5.0, 0.8, 0.15, 4.3, 1.8, 1.45);
    truth_[kVelocity] = speed;
    shift_ = Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_)) * pose_sigma;
    error_.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(pose_sigma * pose_sigma);
    error_.covariance.topLeftCorner<3, 3>().diagonal().setConstant(1e-8);
    for (int k = 0; k < 18; ++k) look(k);
  }

  FrameContext frame() const {
    const auto& last = *keyframes_.back()->from;
    return {last.view, last.error, nullptr, &priors_, &parameters_, keyframes_.back()->from};
  }
  const Keyframes& keyframes() const { return keyframes_; }
  Keyframes& keyframes() { return keyframes_; }
  const State& truth() const { return truth_; }  ///< at the last look
  Parameters& parameters() { return parameters_; }

  /// What a filter might hold after a bad first box.
  Hypothesis start(bool moving) const {
    Hypothesis h;
    h.class_name = "car";
    h.moving = moving;
    h.weight = 1.0;
    h.x = truth_;
    h.x.tail<3>().setZero();
    h.x.head<3>() += Eigen::Vector3d(4.0, 0.6, 0.1);
    h.x.segment<3>(kSize).array() += 0.12;
    return h;
  }

 private:
  void look(int k) {
    const double t = 0.2 * k;
    RigidTransform believed;
    believed.p = Eigen::Vector3d(1.4 * k, 0.0, 1.2);
    RigidTransform true_pose = believed;
    true_pose.p += shift_;
    State x = truth_;
    x.head<3>() += t * truth_.tail<3>();
    const View seen{&camera_, true_pose, Eigen::Vector3d::UnitZ()};
    const auto box = projectCuboid(x, seen);
    if (!box) return;
    const double width = box->sides[2] - box->sides[0], height = box->sides[3] - box->sides[1];
    Keyframe keyframe;
    const Box b{box->sides[0], box->sides[1], box->sides[2], box->sides[3]};
    keyframe.z = measure(b, camera_.width(), camera_.height(), parameters_.box, {});
    for (int i = 0; i < 4; ++i) {  // b: one draw for all, in shares of the box
      const double size = i % 2 == 0 ? width : height;
      if (k == 0) bias_[i] = normal_(random_);
      keyframe.z.sides[i] += std::sqrt(keyframe.z.variance[i]) * normal_(random_) +
                             0.5 * std::sqrt(keyframe.z.lasting[i]) * bias_[i];
      EXPECT_GT(size, 0.0);
    }
    keyframe.from = std::make_shared<const FrameView>(
        View{&camera_, believed, seen.up_W}, error_, fromNanoseconds(std::int64_t{200'000'000} * k),
        std::make_shared<const BoxStyles>());
    keyframes_.push_back(std::make_shared<const Keyframe>(keyframe));
    if (k == 17) truth_.head<3>() += t * truth_.tail<3>();
  }

  CameraModel camera_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  ClassPriors priors_;
  Parameters parameters_;
  State truth_;
  Eigen::Vector3d shift_;
  PoseError error_;
  Eigen::Vector4d bias_ = Eigen::Vector4d::Zero();
  Keyframes keyframes_;
};

/// The same looks, their boxes' noise `factor` times as it was, at a time when the errors of their
/// network were taken for `then`.
Keyframes lookedAs(const Keyframes& looks, double factor, const NoiseScale& then) {
  Keyframes result;
  for (const auto& look : looks) {
    Keyframe k = *look;
    const FrameView& v = *look->from;
    k.from = std::make_shared<const FrameView>(v.view, v.error, v.time, v.styles, then);
    k.z.variance *= factor;
    k.z.lasting *= std::sqrt(factor);
    result.push_back(std::make_shared<const Keyframe>(k));
  }
  return result;
}

Eigen::Vector3d placeError(const MapFit& s, const Passing& scene) {
  return (s.hypothesis().x - scene.truth()).head<3>();
}

TEST(Smoother, FindsThePlaceFromMetresAway) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Passing scene(seed);
    const FrameContext frame = scene.frame();
    const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
    const auto s = MapFit::make(scene.start(false), looks, frame);
    ASSERT_TRUE(s) << seed;
    EXPECT_LT(placeError(*s, scene).norm(), 0.7) << seed;
    EXPECT_LT(s->contradicted(), 0.1) << seed;
  }
}

TEST(Smoother, OldLooksCountAsTheirNetworkIsKnownNow) {
  const Passing scene(3);
  FrameContext frame = scene.frame();
  frame.noise_scale = {17, 0.25};
  const Keyframes early = lookedAs(scene.keyframes(), 1.0, {17, 1.0});
  const Keyframes late = lookedAs(scene.keyframes(), 0.25, {17, 0.25});
  const Keyframes other = lookedAs(scene.keyframes(), 1.0, {18, 1.0});
  std::vector<Hypothesis> fits;
  for (const Keyframes* looks : {&early, &late, &other}) {
    const KeyframeBatch all(*looks, frame.pose_error);
    const auto s = MapFit::make(scene.start(false), all, frame);
    ASSERT_TRUE(s);
    fits.push_back(s->hypothesis());
  }
  EXPECT_LT((fits[0].x - fits[1].x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((fits[0].P - fits[1].P).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT(fits[2].P(0, 0), 1.2 * fits[0].P(0, 0));  // nothing was learned of that one
}

TEST(Smoother, LeavesOverWhatTheBoxesErrMoreThanAssumed) {
  double left = 0.0, sides = 0.0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Passing scene(seed);
    const FrameContext frame = scene.frame();
    const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
    const auto s = MapFit::make(scene.start(false), looks, frame);
    ASSERT_TRUE(s) << seed;
    left += s->residualRatio().count * s->residualRatio().ratio;
    sides += s->residualRatio().count;
  }
  EXPECT_NEAR(left / sides, 1.0, 0.15);
}

TEST(Smoother, KnowsNoPlaceBetterThanThePosesThatItWasSeenFrom) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Passing scene(seed, 0.0, 0.3);
    const FrameContext frame = scene.frame();
    const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
    const auto mode = MapFit::make(scene.start(false), looks, frame);
    ASSERT_TRUE(mode) << seed;
    EXPECT_TRUE(isJointCovariance(mode->hypothesis(), frame.pose_error.covariance)) << seed;
    for (const double turn : {-0.8, 0.8, M_PI / 2}) {  // each begins with what the first one found
      Hypothesis start = mode->hypothesis();
      start.x[kYaw] += turn;
      const auto other = MapFit::make(start, looks, frame, &*mode);
      if (!other) continue;
      EXPECT_TRUE(isJointCovariance(other->hypothesis(), frame.pose_error.covariance)) << seed;
    }
  }
}

TEST(Smoother, SaysTruthfullyHowWellItKnowsThePlace) {
  double nees = 0.0;
  constexpr int kRuns = 60;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Passing scene(seed, 0.0, 0.3);
    const FrameContext frame = scene.frame();
    const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
    const auto s = MapFit::make(scene.start(false), looks, frame);
    ASSERT_TRUE(s) << seed;
    const Eigen::Vector3d e = placeError(*s, scene);
    nees += e.dot(s->hypothesis().P.topLeftCorner<3, 3>().ldlt().solve(e)) / kRuns;
  }
  // Three degrees of freedom; the truth's size is not drawn from the prior, and b not from its
  // process, so that the band is wide.
  EXPECT_GT(nees, 1.0);
  EXPECT_LT(nees, 5.0);
}

TEST(Smoother, CorrelatesThePlaceWithThePresentPoseError) {
  const Passing scene(3, 0.0, 0.3);
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  const auto s = MapFit::make(scene.start(false), looks, frame);
  ASSERT_TRUE(s);
  // All poses share one error: beside the body the place is known far better than in W.
  EXPECT_LT(placeSigma(s->hypothesis(), frame.pose_error.covariance),
            0.75 * std::sqrt(s->hypothesis().P.topLeftCorner<3, 3>().trace()));
}

TEST(Smoother, OneBoxOfAnotherThingCountsLittle) {
  Passing scene(5);
  Keyframe wrong = *scene.keyframes()[9];
  wrong.z.sides += Eigen::Vector4d(60, 5, 70, 8);
  scene.keyframes()[9] = std::make_shared<const Keyframe>(wrong);
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  const auto s = MapFit::make(scene.start(false), looks, frame);
  ASSERT_TRUE(s);
  EXPECT_GT(s->inflations()[9], 5.0);
  EXPECT_LT(placeError(*s, scene).norm(), 0.8);
}

TEST(Smoother, TellsWhatMovesFromWhatStands) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double speed : {0.0, 5.0}) {
      const Passing scene(seed, speed);
      const FrameContext frame = scene.frame();
      const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
      const auto still = MapFit::make(scene.start(false), looks, frame);
      const auto moving = MapFit::make(scene.start(true), looks, frame);
      ASSERT_TRUE(moving) << seed;
      if (speed > 0.0) {
        EXPECT_NEAR(moving->hypothesis().x[kVelocity], speed, 1.5) << seed;
        if (!still) continue;  // nothing that stands fits
      }
      ASSERT_TRUE(still) << seed;
      const Eigen::VectorXd inflations = still->inflations().cwiseMin(moving->inflations());
      const double odds = still->logEvidence(inflations) - moving->logEvidence(inflations);
      if (speed > 0.0) {
        EXPECT_LT(odds, -3.0) << seed;
      } else {
        EXPECT_GT(odds, 1.0) << seed;
      }
    }
  }
}

TEST(Smoother, TakesNoPlaceThatTheLooksDoNotFix) {
  Passing scene(2);
  scene.parameters().smoothing.place = 1e-4;
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  EXPECT_FALSE(MapFit::make(scene.start(false), looks, frame));
}

/// One that took the wrong one of the starts of yaw, for which the boxes speak less.
Track turnedBy(double angle, const Passing& scene) {
  Hypothesis h = scene.start(false);
  h.x[kYaw] = wrapAngle(h.x[kYaw] + angle);
  Track object;
  object.hypotheses = {h};
  object.batch.keyframes = scene.keyframes();
  object.batch.seen = static_cast<std::uint32_t>(object.batch.keyframes.size());
  return object;
}

TEST(Smooth, SeeksTheYawThatTheFilterGaveUp) {
  int found = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const Passing scene(seed);
    Track object = turnedBy(M_PI / 2, scene);
    refit(object, scene.frame());
    const double error = std::remainder(object.best().x[kYaw] - scene.truth()[kYaw], M_PI);
    found += std::abs(error) < 0.2 ? 1 : 0;
    // It is not sought again before as many looks have come.
    EXPECT_EQ(object.batch.mode_search_due, 2 * scene.keyframes().size());
  }
  EXPECT_GE(found, 17) << "of " << kRuns;
}

/// Whether anything of a car at rest moves after its smoothing, beside a ground at `height`.
bool mayMoveOver(double height, const Passing& scene) {
  FrameContext frame = scene.frame();
  BodyPath path;
  for (double x = 0.0; x <= 24.0; x += 4.0) path.go({x, 0.0, 1.2});
  GroundParameters ground;
  ground.body_height_m = 1.2 - height;
  frame.ground = std::make_shared<const GroundSurface>(
      std::vector<Track>{}, path, GroundRoughness{}, frame.view.up_W, *frame.priors, ground);
  Track object = turnedBy(0.0, scene);
  refit(object, frame);
  const auto& hs = object.hypotheses.read();
  return std::any_of(hs.begin(), hs.end(), [](const Hypothesis& h) { return h.moving; });
}

TEST(Smooth, WhatStandsBelowTheGroundMayMoveInstead) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Passing scene(seed);
    const double underside = scene.truth()[2] - 0.5 * std::exp(scene.truth()[kSize + 2]);
    EXPECT_FALSE(mayMoveOver(underside, scene)) << seed;
    EXPECT_TRUE(mayMoveOver(underside + 0.8, scene)) << seed;
  }
}

/// What the looks at a car make of a thing of no known class that the network takes for a
/// `lookalike_class`.
std::string classAfterAll(const Passing& scene, const std::string& lookalike_class) {
  Track object = turnedBy(0.0, scene);
  object.hypotheses.front().class_name = kOtherClass;
  object.lookalike.class_name = lookalike_class;
  refit(object, scene.frame());
  return object.best().class_name;
}

TEST(Smooth, WhatIsOfNoKnownClassBecomesTheOneItResemblesWhereAllLooksAreOfIt) {
  int cars = 0;
  constexpr int kRuns = 20;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    cars += classAfterAll(Passing(seed), "car") == "car" ? 1 : 0;
    EXPECT_EQ(classAfterAll(Passing(seed), "chair"), kOtherClass) << "of a car's size";
    EXPECT_EQ(classAfterAll(Passing(seed), "unicorn"), kOtherClass) << "of no known size";
    EXPECT_EQ(classAfterAll(Passing(seed), ""), kOtherClass);
  }
  EXPECT_GE(cars, 18) << "of " << kRuns;
}

TEST(Smooth, ModesThatTheLooksDoNotTellApartAreKeptAndPublishedAsOneWideGaussian) {
  const Passing scene(4);
  Track object = turnedBy(0.0, scene);
  Hypothesis turned = object.hypotheses.front();
  object.hypotheses.front().weight = 0.6;
  turned.weight = 0.4;
  turned.x[kYaw] += 1.0;
  turned.P(kYaw, kYaw) = object.hypotheses.front().P(kYaw, kYaw) = 0.01;
  object.hypotheses.push_back(turned);
  const ObjectBelief belief = toBelief(object, 0.7);
  EXPECT_NEAR(belief.best().mean[3], object.best().x[kYaw], 1e-12);
  EXPECT_NEAR(belief.best().covariance(3, 3), 0.01 + 0.4 * 1.0, 1e-9);
}

/// The same looks with exact boxes of what has its roof behind its middle, and, if told, azimuths.
Keyframes ofLeaning(const Keyframes& looks, const State& truth, bool with_azimuths) {
  auto styles = std::make_shared<BoxStyles>();
  styles->rest.shape = shapeOf({{-1, 1, 1, 1}, {0, 1, 1, 1}, {1, 0.3, 0.7, 1, -0.5}});
  Keyframes result;
  for (const auto& look : looks) {
    Keyframe k = *look;
    const FrameView& v = *look->from;
    k.from = std::make_shared<const FrameView>(v.view, v.error, v.time, styles, v.noise_scale);
    k.z.sides = projectCuboid(truth, v.projector, styles->rest.shape, 1.0)->sides;
    if (with_azimuths) {
      k.azimuth = wrapAngle(yawFromAzimuth(0.0, truth.head<3>(), v.view) - truth[kYaw]);
    }
    result.push_back(std::make_shared<const Keyframe>(k));
  }
  return result;
}

TEST(MapFit, BoxesOfWhatLeansAreExplainedIfAzimuthsSayWhereItFaces) {
  Passing scene(6);
  const auto left_over = [&](bool with_azimuths, double turned) {
    const Keyframes keyframes = ofLeaning(scene.keyframes(), scene.truth(), with_azimuths);
    FrameContext frame = scene.frame();
    frame.frame_view = keyframes.back()->from;
    const KeyframeBatch looks(keyframes, frame.pose_error);
    Hypothesis start = scene.start(false);
    start.x[kYaw] = wrapAngle(start.x[kYaw] + turned);
    const auto fit = MapFit::make(start, looks, frame);
    return fit ? fit->residualRatio().ratio : 1e9;
  };
  const double told = left_over(true, 0.0);
  EXPECT_NEAR(left_over(true, M_PI), told, 1e-3 * told) << "it began the other way round";
  EXPECT_GT(left_over(false, 0.0), 1.5 * told);
}

TEST(BatchProblem, WhetherACutSideCountsDoesNotChangeItsVolume) {
  Passing scene(6);
  const FrameContext frame = scene.frame();
  const auto volume = [&](double cut_at) {
    Keyframe cut = *scene.keyframes()[9];
    const auto box = projectCuboid(scene.truth(), cut.from->view);
    cut.z.measured[2] = false;
    cut.z.sides[2] = box->sides[2] + cut_at;
    Keyframes keyframes = scene.keyframes();
    keyframes[9] = std::make_shared<const Keyframe>(cut);
    const KeyframeBatch looks(keyframes, frame.pose_error);
    const BatchProblem model(looks, false, "car", scene.truth(), frame);
    const auto stack = model.linearise(scene.truth());
    const Eigen::VectorXd inflations =
        Eigen::VectorXd::Ones(static_cast<Eigen::Index>(looks.size()));
    SideCovariance covariance;
    model.covariance(scene.truth(), *stack, covariance);
    const Cholesky R(covariance.with(inflations));
    EXPECT_EQ(stack->counts[9][2], cut_at > 0.0);
    return std::pair(R.logDeterminant(), model.logVolumeOfCuts(*stack, inflations));
  };
  const auto beyond = volume(-1.0), inside = volume(1.0);
  EXPECT_GT(std::abs(beyond.first - inside.first), 10.0);
  EXPECT_NEAR(beyond.first - beyond.second, inside.first - inside.second, 1.0);
}

TEST(Insets, MoveTheBoxInwardsAndAreAMeanForWhatTheyDoNotName) {
  ModelInfo info = testing::makeModelInfo();
  info.side_insets = {0.1, 0.0, 0.1, 0.2, 0, 0, 0, 0, 0, 0, 0, 0, 0.02, 0.04, 0.06, 0.08};
  const Model model = makeModel(info);
  const CameraModel camera{makeCamera()};
  const View view{&camera, RigidTransform(), Eigen::Vector3d::UnitZ()};
  const State x = makeState(20, 1, 0, 0.4, 4, 2, 1.5);
  const auto whole = projectCuboid(x, view);
  const auto car = projectObserved(x, view, model.styles->of("car"));
  ASSERT_TRUE(whole && car);
  const double w = whole->sides[2] - whole->sides[0], h = whole->sides[3] - whole->sides[1];
  EXPECT_TRUE(car->sides.isApprox(whole->sides + Eigen::Vector4d(0.1 * w, 0, -0.1 * w, -0.2 * h)));
  EXPECT_TRUE(
      model.styles->of(kOtherClass).offset.isApprox(Eigen::Vector4d(0.03, 0.01, -0.04, -0.07)));
  EXPECT_TRUE(makeModel(testing::makeModelInfo()).styles->of("car").offset.isZero());
}

TEST(BoxStyles, AreThePriorsShapesWhereTheBoxesEncloseOutlines) {
  ClassPriors priors;
  priors.classes = {ClassPrior{.name = "car"}, ClassPrior{.name = "unicorn"}};
  priors.classes[0].shape = shapeOf({{-1, 0.5, 0.5, 1}, {1, 1, 1, 0.5}});
  ModelInfo info = testing::makeModelInfo();
  EXPECT_TRUE(makeModel(info, priors).styles->of("car").shape.is_cuboid);
  info.boxes = BoxExtent::kOutline;
  info.side_insets.assign(4 * info.classes.size(), 0.02);
  const Model model = makeModel(info, priors);
  EXPECT_EQ(model.styles->of("car").shape.corners(), 12);
  EXPECT_DOUBLE_EQ(model.styles->of("car").offset[0], 0.02);
  EXPECT_TRUE(model.styles->of("unicorn").shape.is_cuboid);
  EXPECT_DOUBLE_EQ(model.styles->of("unicorn").offset[3], -0.02)
      << "of a class that the network does not know: the mean";
  EXPECT_TRUE(model.styles->of(kOtherClass).shape.is_cuboid);
}

TEST(Keyframes, NewViewsAreRememberedAndTheMostAlikeForgotten) {
  const Passing scene(1);
  SmoothingParameters parameters;
  parameters.keyframes = 6;
  parameters.new_view = 0.05;
  const ViewScales scales{0.3, 0.3, 0.3};
  Track object;
  Hypothesis h = scene.start(false);
  h.x = scene.truth();
  object.hypotheses = {h};
  for (const auto& k : scene.keyframes()) addKeyframe(object, *k, scales, parameters);
  ASSERT_EQ(object.batch.keyframes.size(), 6U);
  EXPECT_FALSE(addKeyframe(object, *scene.keyframes().back(), scales, parameters));
  EXPECT_TRUE(
      std::is_sorted(object.batch.keyframes.begin(), object.batch.keyframes.end(),
                     [](const auto& a, const auto& b) { return a->from->time < b->from->time; }));
  // They span the whole drive, not its end.
  EXPECT_LT(toSeconds(object.batch.keyframes.front()->from->time), 1.5);
  Track other = object;
  other.batch.keyframes = {scene.keyframes()[1], scene.keyframes()[2]};
  mergeBatches(object, other, scales, parameters);
  EXPECT_LE(object.batch.keyframes.size(), 6U);
}

}  // namespace
}  // namespace perdure::semantic_filter

#include "services/semantic_filter/core/smoothing/map_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "tests/services/semantic_filter/core/smoothing/passing_car.h"

namespace perdure::semantic_filter {
namespace {

using testing::Passing;

/// Returns the keyframes with variances `factor` times as large, recorded when the scales of their
/// network were `then`.
Keyframes lookedAs(const Keyframes& looks, const SideScales& factor, const NoiseScale& then) {
  Keyframes result;
  for (const auto& look : looks) {
    Keyframe k = *look;
    const FrameView& v = *look->from;
    k.from = std::make_shared<const FrameView>(v.view, v.error, v.time, v.styles, then);
    k.z.variance *= factor.noise;
    k.z.lasting *= factor.lasting;
    result.push_back(std::make_shared<const Keyframe>(k));
  }
  return result;
}

Eigen::Vector3d placeError(const MapFit& s, const Passing& scene) {
  return (s.hypothesis().x - scene.truth()).head<3>();
}

TEST(MapFit, FindsThePlaceFromAStartMetresAway) {
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

TEST(MapFit, OldKeyframesUseThePresentScales) {
  const Passing scene(3);
  FrameContext frame = scene.frame();
  const SideScales now{0.25, 0.5};
  frame.noise_scale = {17, now};
  const Keyframes early = lookedAs(scene.keyframes(), {}, {17, {}});
  const Keyframes late = lookedAs(scene.keyframes(), now, {17, now});
  const Keyframes other = lookedAs(scene.keyframes(), {}, {18, {}});
  std::vector<Hypothesis> fits;
  for (const Keyframes* looks : {&early, &late, &other}) {
    const KeyframeBatch all(*looks, frame.pose_error);
    const auto s = MapFit::make(scene.start(false), all, frame);
    ASSERT_TRUE(s);
    fits.push_back(s->hypothesis());
  }
  EXPECT_LT((fits[0].x - fits[1].x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((fits[0].P - fits[1].P).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT(fits[2].P(0, 0), 1.2 * fits[0].P(0, 0));  // no scale was learned for this network
}

/// Returns the keyframes with boxes whose errors are drawn from the model, with its variances times
/// `truth`: b keeps the share viewCorrelation from one keyframe to the next.
Keyframes drawnFrom(const Passing& scene, const SideScales& truth, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto four = [&] {
    return Eigen::Vector4d(normal(random), normal(random), normal(random), normal(random));
  };
  Keyframes result;
  Eigen::Vector4d b = four();
  for (const auto& look : scene.keyframes()) {
    Keyframe k = *look;
    if (!result.empty()) {
      const double kept =
          viewCorrelation(scene.truth().head<3>(), result.back()->from->T_WC, look->from->T_WC,
                          biasScales(scene.frame().parameters->box));
      b = kept * b + std::sqrt(1.0 - kept * kept) * four();
    }
    k.z.sides = projectObserved(scene.truth(), k.from->view, BoxStyle())->sides +
                (truth.noise * k.z.variance).cwiseSqrt().cwiseProduct(four()) +
                (truth.lasting * k.z.lasting).cwiseSqrt().cwiseProduct(b);
    result.push_back(std::make_shared<const Keyframe>(k));
  }
  return result;
}

/// Returns the scales that one Fisher step finds from the residuals of forty cars, whose boxes have
/// the assumed variances times `truth`.
SideScales scalesByOneStep(const SideScales& truth) {
  SideEvidence all;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Passing scene(seed);
    const FrameContext frame = scene.frame();
    const Keyframes keyframes = drawnFrom(scene, truth, seed);
    const KeyframeBatch looks(keyframes, frame.pose_error);
    const auto s = MapFit::make(scene.start(false), looks, frame);
    EXPECT_TRUE(s) << seed;
    if (!s) continue;
    all.information += s->sideEvidence().information;
    all.gradient += s->sideEvidence().gradient;
  }
  const Eigen::Vector2d logs = all.information.inverse() * all.gradient;
  return {std::exp(logs[0]), std::exp(logs[1])};
}

TEST(MapFit, ResidualsGiveTheVariancesOfTheSides) {
  const SideScales as_assumed = scalesByOneStep({});
  EXPECT_NEAR(as_assumed.noise, 1.0, 0.15);
  EXPECT_NEAR(as_assumed.lasting, 1.0, 0.4);
  const SideScales noisy = scalesByOneStep({1.6, 1.0}), biased = scalesByOneStep({1.0, 2.0});
  EXPECT_GT(noisy.noise, 1.4);
  EXPECT_LT(noisy.lasting, 1.5);
  EXPECT_GT(biased.lasting, 1.4);
  EXPECT_LT(biased.noise, 1.3);
}

TEST(MapFit, TheJointCovarianceWithThePoseStaysConsistent) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Passing scene(seed, 0.0, 0.3);
    const FrameContext frame = scene.frame();
    const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
    const auto mode = MapFit::make(scene.start(false), looks, frame);
    ASSERT_TRUE(mode) << seed;
    EXPECT_TRUE(isJointCovariance(mode->hypothesis(), frame.pose_error.covariance)) << seed;
    for (const double turn : {-0.8, 0.8, M_PI / 2}) {  // each starts from the first fit
      Hypothesis start = mode->hypothesis();
      start.x[kYaw] += turn;
      const auto other = MapFit::make(start, looks, frame, &*mode);
      if (!other) continue;
      EXPECT_TRUE(isJointCovariance(other->hypothesis(), frame.pose_error.covariance)) << seed;
    }
  }
}

TEST(MapFit, TheCovarianceIsHonest) {
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
  // Three degrees of freedom. The band is wide, because the true size is not drawn from the prior,
  // nor b from its process.
  EXPECT_GT(nees, 1.0);
  EXPECT_LT(nees, 5.0);
}

TEST(MapFit, ThePlaceIsCorrelatedWithThePresentPoseError) {
  const Passing scene(3, 0.0, 0.3);
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  const auto s = MapFit::make(scene.start(false), looks, frame);
  ASSERT_TRUE(s);
  // All poses share one error, so the position relative to the body is far more certain than the
  // position in W.
  EXPECT_LT(placeSigma(s->hypothesis(), frame.pose_error.covariance),
            0.75 * std::sqrt(s->hypothesis().P.topLeftCorner<3, 3>().trace()));
}

TEST(MapFit, OneBoxOfAnotherObjectCountsLittle) {
  Passing scene(5);
  Keyframe wrong = *scene.keyframes()[9];
  wrong.z.sides += Eigen::Vector4d(60, 5, 70, 8);
  scene.keyframes()[9] = std::make_shared<const Keyframe>(wrong);
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  const auto s = MapFit::make(scene.start(false), looks, frame);
  ASSERT_TRUE(s);
  EXPECT_LT(placeError(*s, scene).norm(), 0.8);
}

TEST(MapFit, DistinguishesMotionFromRest) {
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
        if (!still) continue;  // no hypothesis at rest fits
      }
      ASSERT_TRUE(still) << seed;
      const double odds = still->logEvidence() - moving->logEvidence();
      if (speed > 0.0) {
        EXPECT_LT(odds, -3.0) << seed;
      } else {
        EXPECT_GT(odds, 1.0) << seed;
      }
    }
  }
}

/// The last two boxes of a parked car are bad, with errors that a motion would explain.
TEST(MapFit, BadBoxesAreNoMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Passing scene(seed);
    const FrameContext good = scene.frame();
    Keyframes& keyframes = scene.keyframes();
    for (std::size_t i = keyframes.size() - 2; i < keyframes.size(); ++i) {
      Keyframe bad = *keyframes[i];
      bad.z.sides[0] -= 8.0 * std::sqrt(bad.z.variance[0]);
      keyframes[i] = std::make_shared<const Keyframe>(bad);
    }
    const KeyframeBatch looks(keyframes, good.pose_error);
    const auto still = MapFit::make(scene.start(false), looks, good);
    const auto moving = MapFit::make(scene.start(true), looks, good);
    ASSERT_TRUE(still && moving) << seed;
    EXPECT_GT(still->logEvidence() - moving->logEvidence(), 0.0) << seed;
  }
}

TEST(MapFit, TheEvidenceTellsOutlinesFromCuboids) {
  const auto outlines = std::make_shared<BoxStyles>();
  outlines->rest.shape = shapeOf({{-1, 1, 1, 0.7}, {0, 1, 1, 0.7}, {1, 0.55, 0.75, 0.8}});
  const auto cuboids = std::make_shared<const BoxStyles>();
  for (const auto& truth : {std::shared_ptr<const BoxStyles>(outlines), cuboids}) {
    double nats = 0.0;
    for (unsigned seed = 1; seed <= 10; ++seed) {
      Passing scene(seed);
      for (auto& k : scene.keyframes()) {
        Keyframe drawn = *k;
        const auto as = [&](const BoxStyles& styles) {
          return projectObserved(scene.truth(), k->from->projector, styles.rest)->sides;
        };
        drawn.z.sides += as(*truth) - as(*cuboids);
        k = std::make_shared<const Keyframe>(drawn);
      }
      FrameContext frame = scene.frame();
      const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
      frame.styles = cuboids.get();
      const auto as_cuboid = MapFit::make(scene.start(false), looks, frame);
      FrameContext other = frame;
      other.styles = outlines.get();
      const auto as_outline = MapFit::make(scene.start(false), looks, other);
      ASSERT_TRUE(as_cuboid && as_outline) << seed;
      nats += as_outline->logEvidence() - as_cuboid->logEvidence();
    }
    EXPECT_GT(truth == cuboids ? -nats : nats, 5.0);
  }
}

TEST(MapFit, RefusesAPlaceThatTheKeyframesDoNotDetermine) {
  Passing scene(2);
  scene.parameters().smoothing.place = 1e-4;
  const FrameContext frame = scene.frame();
  const KeyframeBatch looks(scene.keyframes(), frame.pose_error);
  EXPECT_FALSE(MapFit::make(scene.start(false), looks, frame));
}

/// Returns the keyframes with exact boxes of an object whose roof is behind its centre, and with
/// azimuths if `with_azimuths`.
Keyframes ofLeaning(const Keyframes& looks, const State& truth, bool with_azimuths) {
  auto styles = std::make_shared<BoxStyles>();
  styles->rest.shape = shapeOf({{-1, 1, 1, 1}, {0, 1, 1, 1}, {1, 0.3, 0.7, 1, -0.5}});
  Keyframes result;
  for (const auto& look : looks) {
    Keyframe k = *look;
    const FrameView& v = *look->from;
    k.from = std::make_shared<const FrameView>(v.view, v.error, v.time, styles, v.noise_scale);
    k.z.sides = projectObserved(truth, v.projector, styles->rest, 1.0)->sides;
    if (with_azimuths) {
      k.azimuth = wrapAngle(yawFromAzimuth(0.0, truth.head<3>(), v.view) - truth[kYaw]);
    }
    result.push_back(std::make_shared<const Keyframe>(k));
  }
  return result;
}

TEST(MapFit, AzimuthsLetAnAsymmetricShapeExplainItsBoxes) {
  Passing scene(6);
  /// Returns the mean error of the fitted sides, px.
  const auto error = [&](bool with_azimuths, double turned) {
    const Keyframes keyframes = ofLeaning(scene.keyframes(), scene.truth(), with_azimuths);
    FrameContext frame = scene.frame();
    frame.frame_view = keyframes.back()->from;
    const KeyframeBatch looks(keyframes, frame.pose_error);
    Hypothesis start = scene.start(false);
    start.x[kYaw] = wrapAngle(start.x[kYaw] + turned);
    const auto fit = MapFit::make(start, looks, frame);
    if (!fit) return 1e9;
    double sum = 0.0;
    for (const auto& k : keyframes) {
      const auto box = projectObserved(fit->hypothesis().x, k->from->projector,
                                       k->from->styles->rest, headingOf(fit->logHeading()));
      sum += (box->sides - k->z.sides).cwiseAbs().mean() / static_cast<double>(keyframes.size());
    }
    return sum;
  };
  const double told = error(true, 0.0);
  EXPECT_NEAR(error(true, M_PI), told, 1e-3 * told) << "it started turned by 180 degrees";
  EXPECT_GT(error(false, 0.0), 1.3 * told);
}

TEST(BatchProblem, WhetherACensoredSideCountsDoesNotChangeTheVolume) {
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
    Hypothesis car;
    car.class_name = "car";
    const BatchProblem model(looks, car, scene.truth(), frame);
    const auto stack = model.linearise(scene.truth());
    const Eigen::VectorXd inflations =
        Eigen::VectorXd::Ones(static_cast<Eigen::Index>(looks.size()));
    SideCovariance covariance;
    model.covariance(scene.truth(), *stack, covariance);
    Cholesky<SideMatrix> R;
    covariance.factorise(inflations, R);
    EXPECT_EQ(stack->counts[9][2], cut_at > 0.0);
    return std::pair(R.logDeterminant(), model.logVolumeOfCuts(*stack, inflations));
  };
  const auto beyond = volume(-1.0), inside = volume(1.0);
  EXPECT_GT(std::abs(beyond.first - inside.first), 10.0);
  EXPECT_NEAR(beyond.first - beyond.second, inside.first - inside.second, 1.0);
}

}  // namespace
}  // namespace perdure::semantic_filter

// A body that stands in moving traffic must stay in place, and a body in uniform motion must not be
// detected as resting.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <tuple>

#include "services/vio/node.h"
#include "tests/services/vio/traffic_scene.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

struct Drive {
  std::size_t poses = 0;
  std::optional<double> started_s;
  double farthest_m = 0.0, largest_deviation = 0.0;  ///< error, and its ratio to the standard
                                                     ///< deviation
  double last_error_m = 0.0, last_speed = 0.0;
  std::string status;
};

Drive play(const test::TrafficOptions& options, double until) {
  test::TrafficScene scene(options);
  Drive result;
  std::optional<Vector3d> origin;
  Node node(Config{}, 5,
            {[&](const Odometry& o) {
               if (o.state == OdometryState::kInitialising) return;
               const double t = toSeconds(o.stamp.time - scene.time(0.0));
               if (!origin) {
                 origin = o.T_WB.p - scene.position(t);
                 result.started_s = t;
               }
               const Vector3d e = o.T_WB.p - *origin - scene.position(t);
               const Vector3d sigma = o.covariance.diagonal().segment<3>(3).cwiseSqrt();
               ++result.poses;
               result.last_error_m = e.norm();
               result.last_speed = o.v_WB.norm();
               result.farthest_m = std::max(result.farthest_m, e.norm());
               result.largest_deviation =
                   std::max(result.largest_deviation, e.cwiseAbs().cwiseQuotient(sigma).maxCoeff());
             },
             {}});
  node.onCalibration(scene.calibration());
  for (int i = 0; 0.005 * i < until; ++i) {
    if (i % 10 == 0) node.onFrame(scene.frame(0.005 * i));
    node.onImu(scene.imu(0.005 * i));
  }
  node.flush();
  result.status = node.status();
  return result;
}

/// One seed of twelve seconds. PERDURE_TRAFFIC_SEEDS sets a larger number, of a minute each, for
/// measurements.
unsigned seeds() {
  const char* text = std::getenv("PERDURE_TRAFFIC_SEEDS");
  return text ? static_cast<unsigned>(std::atoi(text)) : 1u;
}
double until() { return seeds() > 1 ? 60.0 : 12.0; }

class StandingInTraffic : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(StandingInTraffic, StaysWhereItIs) {
  const auto [cover, begins_s] = GetParam();
  for (unsigned seed = 1; seed <= seeds(); ++seed) {
    const Drive d = play({.seed = seed, .cover = cover, .begins_s = begins_s}, until());
    if (seeds() > 1) {
      std::printf("cover %.2f from %g s, seed %u: start %.2f s, %.4f m, %.2f sigma\n", cover,
                  begins_s, seed, d.started_s.value_or(-1), d.farthest_m, d.largest_deviation);
    }
    EXPECT_LT(d.farthest_m, 0.05) << "seed " << seed;
    EXPECT_LT(d.largest_deviation, 3.0) << "seed " << seed;
    // If too little background is visible from the start, the node may wait, and its status must
    // state that.
    const bool may_wait = cover > 0.7 && begins_s < 0.5;
    if (may_wait && d.poses == 0) {
      EXPECT_NE(d.status.find("traffic"), std::string::npos) << d.status;
      continue;
    }
    ASSERT_TRUE(d.started_s) << d.status;
    EXPECT_LT(*d.started_s, may_wait ? until() : 3.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Shares, StandingInTraffic,
                         testing::Combine(testing::Values(0.3, 0.5, 0.8, 0.95),
                                          testing::Values(0.0, 5.0)));

TEST(StandingInTrafficWithAnEngine, StaysWhereItIs) {
  const Drive d = play({.cover = 0.95, .begins_s = 3.0, .engine = 0.5}, until());
  EXPECT_LT(d.farthest_m, 0.05);
  EXPECT_LT(d.largest_deviation, 3.0);
}

/// Stands for `rest` seconds, then accelerates to `speed` within `push` seconds and keeps it.
std::function<Vector3d(double)> pushed(double rest, double push, double speed) {
  return [=](double t) {
    const double s = t - rest, a = speed / push;
    if (s <= 0) return Vector3d(0, 0, 0);
    if (s < push) return Vector3d(0.5 * a * s * s, a * s, a);
    return Vector3d(0.5 * speed * push + speed * (s - push), speed, 0);
  };
}

TEST(EvenDrive, IsNoRestAfterAGentlePush) {
  for (const double speed : {0.3, 1.0}) {
    const Drive d = play({.cover = 0.0, .begins_s = 99, .slide = pushed(3.0, 2.0, speed)}, 12.0);
    EXPECT_NEAR(d.last_speed, speed, 0.3 * speed);
    EXPECT_LT(d.largest_deviation, 4.0);
  }
}

TEST(EvenDrive, IsNoRestWhereHalfOfThePictureIsFarAway) {
  const Drive d = play({.cover = 0.5,
                        .begins_s = 0.0,
                        .speed_px_s = 0.0,
                        .far_background = true,
                        .slide = pushed(3.0, 2.0, 1.0)},
                       12.0);
  EXPECT_NEAR(d.last_speed, 1.0, 0.1);
}

TEST(EvenDrive, BeginsWithoutARestThatIsNone) {
  const Drive d = play({.cover = 0.0, .begins_s = 99, .slide = pushed(-5.0, 2.0, 1.0)}, 8.0);
  EXPECT_EQ(d.poses, 0u);
  EXPECT_NE(d.status.find("IMU"), std::string::npos) << d.status;
}

/// Accelerates to 2 m/s until 3 s, brakes, and stands from 5 s on. The traffic is visible from 4 s
/// on.
TEST(BrakingIntoTraffic, ComesToRest) {
  const auto slide = [](double t) {
    if (t < 1) return Vector3d(0, 0, 0);
    if (t < 3) return Vector3d(0.5 * (t - 1) * (t - 1), t - 1, 1);
    if (t < 5) return Vector3d(2 + 2 * (t - 3) - 0.5 * (t - 3) * (t - 3), 2 - (t - 3), -1);
    return Vector3d(4, 0, 0);
  };
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto driveAt = [&](double cover) {
      return play({.seed = seed, .cover = cover, .begins_s = 4.0, .wall_m = 8, .slide = slide},
                  until());
    };
    for (const double cover : {0.3, 0.5}) {
      const Drive d = driveAt(cover);
      EXPECT_LT(d.last_speed, 0.02);
      EXPECT_LT(d.last_error_m, 0.1);
      EXPECT_LT(d.largest_deviation, 4.0);
    }
    // Known failure: the estimate follows the traffic for a moment, by .2 to .3 m at 8 to 10
    // deviations, and then drifts at up to .05 m/s.
    const Drive most = driveAt(0.8);
    EXPECT_LT(most.last_speed, 0.06);
    EXPECT_LT(most.last_error_m, 0.5);
  }
}

}  // namespace
}  // namespace perdure::vio

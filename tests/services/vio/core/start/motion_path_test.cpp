#include "services/vio/core/start/motion_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr double kSigma = 0.3 / 400;  // rad, of a ray

/// A vehicle that accelerates along x, with rows of points beside its way. A tenth of the matches
/// is wrong.
struct Street {
  Vector3d v0, acceleration, gravity{0, 0, -9.81};
  std::vector<PathFrame> frames;
  std::vector<PathPair> pairs;

  Street(const Vector3d& v, const Vector3d& a, unsigned seed) : v0(v), acceleration(a) {
    std::mt19937 random(seed);
    std::normal_distribution<double> n;
    std::uniform_real_distribution<double> u;
    for (int i = 0; i < 8; ++i) {
      const double t = 0.2 * i;
      frames.push_back({t, Vector3d(1.5, 0, 1), 0.5 * t * t * (acceleration - gravity)});
    }
    const auto ray = [&](const Vector3d& p, double t) -> Vector3d {
      const Vector3d camera = v0 * t + 0.5 * t * t * acceleration;
      return ((p - camera).normalized() + kSigma * Vector3d(n(random), n(random), n(random)))
          .normalized();
    };
    for (const std::size_t span : {1u, 3u}) {
      for (std::size_t i = 0; i + span < frames.size(); ++i) {
        PathPair pair{i, i + span, {}};
        for (int k = 0; k < 60; ++k) {
          const Vector3d p(20 + 80 * u(random), (k % 2 ? 1 : -1) * (4 + 8 * u(random)),
                           6 * u(random) - 1);
          const Vector3d wrong(1, u(random) - 0.5, u(random) - 0.5);
          pair.rays.emplace_back(ray(p, frames[i].t),
                                 k % 10 ? ray(p, frames[i + span].t) : wrong.normalized());
        }
        pairs.push_back(pair);
      }
    }
  }
};

double angle(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Path pathOf(const Street& s) {
  const Vector3d force = s.acceleration - s.gravity;
  return pathWithSpeed(s.v0.norm(), s.frames, s.pairs, -9.81 * force.normalized(), kSigma);
}

TEST(MotionPath, FindsTheDirectionOfAVehicleThatAccelerates) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double speed : {-5.0, 5.0}) {
      const Street s({speed, 0.3, 0}, {1.6, 0, 0}, seed);
      const Path path = pathOf(s);
      EXPECT_LT(angle(path.v0, s.v0), 0.15) << seed << " " << speed;
      EXPECT_NEAR(path.v0.norm(), s.v0.norm(), 1e-9);
      EXPECT_NEAR(path.gravity.norm(), 9.81, 1e-9);
    }
  }
}

TEST(MotionPath, ASpeedThatIsFarTooLowCostsMore) {
  const Street s({6, 0, 0}, {0, 2.5, 0}, 3);
  const Vector3d force = s.acceleration - s.gravity;
  const Path slow = pathWithSpeed(0.3, s.frames, s.pairs, -9.81 * force.normalized(), kSigma);
  EXPECT_GT(slow.cost, pathOf(s).cost + 200.0);
}

TEST(MotionPath, SolvesForTheMinimumOnASphere) {
  const Eigen::Matrix3d M = Vector3d(1.0, 4.0, 0.5).asDiagonal();
  const Vector3d d(3.0, -2.0, 5.0);
  const Vector3d best = solveOnSphere(M, d, 2.0);
  EXPECT_NEAR(best.norm(), 2.0, 1e-9);
  const auto cost = [&](const Vector3d& g) { return 0.5 * g.dot(M * g) - d.dot(g); };
  std::mt19937 random(3);
  std::normal_distribution<double> n;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d other = 2.0 * Vector3d(n(random), n(random), n(random)).normalized();
    EXPECT_LE(cost(best), cost(other) + 1e-9);
  }
}

}  // namespace
}  // namespace perdure::vio

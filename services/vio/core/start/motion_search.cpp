#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/algorithms/stable_sort.h"
#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kAsLikely = 9.0;     // largest difference in cost of minima that fit about as well
constexpr std::ptrdiff_t kTried = 2;  // if these are unobservable, the other searches do not run
constexpr double kSame = 0.01;        // largest relative difference in velocity of equal minima
// The residuals do not contain the part of a view's error that is constant along its track.
constexpr double kNoiseMargin = 1.2;
constexpr double kLeastNoise = 0.25;  // least noise, as a share of vision.sigma_px

const Vector3d& velocity(const RefinedWindow& minimum) { return minimum.window.poses.back().v_B0; }

bool apart(const RefinedWindow& a, const RefinedWindow& b, double share) {
  return (velocity(a) - velocity(b)).norm() >
         share * std::max(velocity(a).norm(), velocity(b).norm());
}

/// Refines all windows and sorts the results by cost, the lowest first. Fails if no refinement
/// succeeds.
using Minima = std::vector<RefinedWindow>;
Result<Minima> refineAll(std::vector<MotionWindow> beginnings, const ImuBuffer& imu,
                         const Options& options) {
  Minima minima;
  Result<Minima> failed;
  for (MotionWindow& window : beginnings) {
    auto minimum = refine(std::move(window), imu, options);
    if (minimum) {
      minima.push_back(std::move(*minimum));
    } else {
      failed = tl::unexpected(minimum.error());
    }
  }
  if (minima.empty()) return failed;
  stableSortBy(minima, [](const RefinedWindow& m) { return m.cost; });
  return minima;
}

double noiseOf(const RefinedWindow& minimum) {
  return std::clamp(kNoiseMargin * minimum.image_noise, kLeastNoise, 1.0);
}

/// Returns true if the velocity stays uncertain with the views' own noise.
bool isUnobservable(const RefinedWindow& minimum) {
  double fastest = 0.0;
  for (const WindowPose& pose : minimum.window.poses) fastest = std::max(fastest, pose.v_B0.norm());
  const double sigma = std::sqrt(minimum.covariance.block<3, 3>(3, 3).trace());
  return !(noiseOf(minimum) * sigma <= kVelocityShare * fastest);
}

/// Removes all but the minimum of lowest cost from each group of equal minima.
void keepApart(Minima& minima) {
  stableSortBy(minima, [](const RefinedWindow& m) { return m.cost; });
  for (auto i = minima.begin(); i != minima.end(); ++i) {
    const auto same = [&](const RefinedWindow& m) { return !apart(*i, m, kSame); };
    minima.erase(std::remove_if(i + 1, minima.end(), same), minima.end());
  }
}

/// Returns true if the body's rotation moves a camera about as far as its translation does. A third
/// search then begins at rest.
bool turnMovesCameras(const MotionWindow& window) {
  constexpr double kShare = 0.3;
  double by_turn = 0.0, by_body = 0.0;
  for (const WindowPoint& point : window.points) {
    for (const WindowView& v : point.views) {
      const WindowPose& pose = window.poses[v.keyframe];
      by_turn = std::max(by_turn, (pose.R_B0_B * v.p_BC - v.p_BC).norm());
      by_body = std::max(by_body, pose.p_B0.norm());
    }
  }
  return by_turn > kShare * by_body;
}

}  // namespace

void placePoints(MotionWindow& window) {
  for (WindowPoint& point : window.points) {
    Matrix3d F = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (const WindowView& v : point.views) {
      const WindowPose& pose = window.poses[v.keyframe];
      const Vector3d ray = pose.R_B0_B * v.R_BC * v.normalised.homogeneous().normalized();
      const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
      F += across;
      b += across * (pose.p_B0 + pose.R_B0_B * v.p_BC);
    }
    F.diagonal().array() += 1e-9 * F.trace();
    point.p_B0 = F.ldlt().solve(b);
  }
}

Result<RefinedWindow> searchMinimum(std::vector<MotionWindow> beginnings, const ImuBuffer& imu,
                                    const Options& options) {
  MotionWindow resting = beginnings.front();
  const auto few = beginnings.begin() + std::min<std::ptrdiff_t>(kTried, std::ssize(beginnings));
  const bool hopeless = std::all_of(beginnings.begin(), few, [&](MotionWindow& window) {
    const auto minimum = refine(window, imu, options);
    if (minimum) window = minimum->window;
    return minimum && isUnobservable(*minimum);
  });
  if (hopeless) return fail("start_unobservable");
  auto minima = refineAll(std::move(beginnings), imu, options);
  if (!minima) return tl::unexpected(minima.error());
  if (turnMovesCameras(minima->front().window)) {
    for (WindowPose& pose : resting.poses) pose.p_B0.setZero(), pose.v_B0.setZero();
    placePoints(resting);
    if (auto at_rest = refine(std::move(resting), imu, options))
      minima->push_back(std::move(*at_rest));
  }
  keepApart(*minima);
  Options as_seen = options;
  as_seen.vision.sigma_px *= noiseOf(minima->front());
  std::vector<MotionWindow> found;
  for (RefinedWindow& minimum : *minima) found.push_back(std::move(minimum.window));
  minima = refineAll(std::move(found), imu, as_seen);
  if (!minima) return tl::unexpected(minima.error());
  const RefinedWindow& best = minima->front();
  for (const RefinedWindow& other : *minima) {
    if (other.cost < best.cost + kAsLikely && apart(best, other, kVelocityShare))
      return fail("start_unobservable");
  }
  return best;
}

}  // namespace perdure::vio

#include "services/vio/core/start/motion_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr double kUsualDepth = 3.0;  // m
constexpr double kAsLikely = 9.0;    // of the cost
// A share of a view's error stays as long as its track does, and no residual shows that share.
constexpr double kNoiseMargin = 1.2;
constexpr double kLeastNoise = 0.25;  // of vision.sigma_px

/// All points `depth` m from the first pose, in the direction of their first view.
void placeAt(MotionWindow& window, double depth) {
  for (WindowPoint& point : window.points) {
    const WindowView& v = point.views.front();
    const WindowPose& pose = window.poses[v.keyframe];
    point.p_B0 = pose.p_B0 + pose.R_B0_B * (v.p_BC + depth * (v.R_BC * v.normalised.homogeneous()));
  }
}

const Vector3d& velocity(const RefinedWindow& minimum) { return minimum.window.poses.back().v_B0; }

bool apart(const RefinedWindow& a, const RefinedWindow& b, double share) {
  return (velocity(a) - velocity(b)).norm() > share * velocity(a).norm();
}

/// Two at most, the less costly first. Fails where there is none.
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
  if (minima.size() == 2 && minima[1].cost < minima[0].cost) std::swap(minima[0], minima[1]);
  return minima;
}

}  // namespace

Result<RefinedWindow> searchMinimum(MotionWindow window, const ImuBuffer& imu,
                                    const Options& options) {
  // The linear solution may be near nothing at all: no motion, no depth. Another search begins
  // where all points are as far as things usually are.
  MotionWindow usual = window;
  placeAt(usual, kUsualDepth);
  auto minima = refineAll({std::move(window), std::move(usual)}, imu, options);
  if (!minima) return tl::unexpected(minima.error());

  constexpr double kSame = 0.01;
  if (minima->size() == 2 && !apart(minima->front(), minima->back(), kSame)) minima->pop_back();
  Options as_seen = options;
  as_seen.vision.sigma_px *=
      std::clamp(kNoiseMargin * minima->front().image_noise, kLeastNoise, 1.0);
  std::vector<MotionWindow> found;
  for (RefinedWindow& minimum : *minima) found.push_back(std::move(minimum.window));
  minima = refineAll(std::move(found), imu, as_seen);
  if (!minima) return tl::unexpected(minima.error());
  const RefinedWindow &best = minima->front(), &other = minima->back();
  if (other.cost < best.cost + kAsLikely && apart(best, other, kVelocityShare)) {
    return fail("start_unobservable");
  }
  return best;
}

}  // namespace perdure::vio

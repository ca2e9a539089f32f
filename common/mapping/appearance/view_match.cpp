#include "common/mapping/appearance/view_match.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/mapping/frames/level_errors.h"
#include "common/math/gaussian.h"
#include "common/math/hamming_distance.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr int kAlike = 64;                 // largest distance of similar descriptors, bits
constexpr double kUnlikeNext = 0.8;        // largest ratio to the distance of the second best
constexpr std::size_t kLeastAgreeing = 4;  // least number of agreeing points
constexpr double kDeviations = 3.0;        // gate, in standard deviations
constexpr double kPointError_m = 0.15;     // error that the covariance of a point does not include
constexpr double kBaseline_m = 1.0;        // least distance of two points that propose a yaw

struct Alike {
  Eigen::Vector3d a, b;
  double variance = 0.0;  // variance of a - b along each axis
};

struct Nearest {
  std::size_t index = 0;
  int best = 257, next = 257;
};

Nearest nearestOf(const SeenPoint& point, const View& among) {
  Nearest nearest;
  for (std::size_t k = 0; k < among.size(); ++k) {
    const int distance = hammingDistance(point.descriptor, among[k].descriptor);
    if (distance < nearest.best) {
      nearest.next = std::exchange(nearest.best, distance);
      nearest.index = k;
    } else {
      nearest.next = std::min(nearest.next, distance);
    }
  }
  return nearest;
}

/// Returns pairs of points whose descriptors are mutual nearest neighbours and pass the ratio test.
std::vector<Alike> alikeOnes(const View& stored, const View& seen) {
  std::vector<Alike> pairs;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const Nearest there = nearestOf(seen[k], stored);
    if (there.best > kAlike || there.best > kUnlikeNext * there.next) continue;
    const SeenPoint& point = stored[there.index];
    if (nearestOf(point, seen).index != k) continue;
    const double variance = static_cast<double>(point.sigma) * point.sigma +
                            static_cast<double>(seen[k].sigma) * seen[k].sigma +
                            kPointError_m * kPointError_m;
    pairs.push_back({point.p.cast<double>(), seen[k].p.cast<double>(), variance});
  }
  return pairs;
}

bool agrees(const Alike& pair, const LevelPose& T_AB) {
  return (T_AB * pair.b - pair.a).squaredNorm() < kDeviations * kDeviations * pair.variance;
}

/// Returns the T_AB that maps the midpoint of two points in B to that of their partners in A, and
/// aligns the two lines. Returns nothing if the points are too close for a yaw.
std::optional<LevelPose> proposedBy(const Alike& first, const Alike& second) {
  const Eigen::Vector3d line_a = second.a - first.a, line_b = second.b - first.b;
  const double sigma = std::sqrt(first.variance + second.variance);
  if (line_a.head<2>().norm() < kBaseline_m || line_b.head<2>().norm() < kBaseline_m) return {};
  if (std::abs(line_a.norm() - line_b.norm()) > kDeviations * sigma) return {};
  LevelPose T_AB;
  T_AB.yaw = wrapAngle(std::atan2(line_a.y(), line_a.x()) - std::atan2(line_b.y(), line_b.x()));
  T_AB.p = 0.5 * (first.a + second.a) - T_AB.R() * (0.5 * (first.b + second.b));
  return T_AB;
}

/// Returns the least-squares pose of the agreeing pairs, starting from `T_AB`. The covariance is
/// widened if the residuals exceed the assumed errors.
LevelGaussian fitted(const std::vector<Alike>& pairs, LevelPose T_AB) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  double chi2 = 0.0, count = 0.0;
  for (int i = 0; i < 5; ++i) {
    information.setZero();
    Eigen::Vector4d pull = Eigen::Vector4d::Zero();
    chi2 = count = 0.0;
    for (const Alike& pair : pairs) {
      if (!agrees(pair, T_AB)) continue;
      const Eigen::Vector3d arm = T_AB.R() * pair.b;
      Eigen::Matrix<double, 3, 4> J = Eigen::Matrix<double, 3, 4>::Zero();
      J.leftCols<3>().setIdentity();
      J(0, 3) = -arm.y();
      J(1, 3) = arm.x();
      const Eigen::Vector3d r = pair.a - T_AB * pair.b;
      information += J.transpose() * J / pair.variance;
      pull += J.transpose() * r / pair.variance;
      chi2 += r.squaredNorm() / pair.variance;
      count += 1.0;
    }
    const Eigen::Vector4d step = inverseSymmetric(information) * pull;
    T_AB.p += step.head<3>();
    T_AB.yaw = wrapAngle(T_AB.yaw + step[3]);
  }
  const double widened = std::max(1.0, chi2 / std::max(3.0 * count - 4.0, 1.0));
  return {T_AB, widened * inverseSymmetric(information)};
}

double logChoose(std::size_t n, std::size_t k) {
  const auto logFactorial = [](std::size_t m) { return std::lgamma(static_cast<double>(m) + 1.0); };
  return logFactorial(n) - logFactorial(k) - logFactorial(n - k);
}

/// Probability that a wrong pair agrees with a proposal by chance: the volume of its gate divided
/// by the volume of the stored points.
double chanceOf(const std::vector<Alike>& pairs) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), spread = Eigen::Vector3d::Zero();
  double gate = 0.0;
  const auto n = static_cast<double>(pairs.size());
  for (const Alike& pair : pairs) middle += pair.a / n;
  for (const Alike& pair : pairs) {
    spread += (pair.a - middle).cwiseAbs2() / n;
    gate += kDeviations * std::sqrt(pair.variance) / n;
  }
  // Width of a uniform distribution with this spread, along each axis.
  const Eigen::Array3d width = (12.0 * spread).cwiseSqrt().array().max(2.0 * gate);
  const double sphere = 4.0 / 3.0 * M_PI * gate * gate * gate;
  return std::min(0.5, sphere / width.prod());
}

}  // namespace

std::optional<ViewMatch> matchViews(const View& stored, const View& seen) {
  const std::vector<Alike> pairs = alikeOnes(stored, seen);
  if (pairs.size() < kLeastAgreeing) return std::nullopt;
  LevelPose best;
  std::size_t most = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = i + 1; j < pairs.size(); ++j) {
      const auto proposed = proposedBy(pairs[i], pairs[j]);
      if (!proposed) continue;
      const auto agreeing = static_cast<std::size_t>(std::count_if(
          pairs.begin(), pairs.end(), [&](const Alike& p) { return agrees(p, *proposed); }));
      if (agreeing <= most) continue;
      most = agreeing;
      best = *proposed;
    }
  }
  if (most < kLeastAgreeing) return std::nullopt;
  ViewMatch match;
  match.T_AB = fitted(pairs, best);
  match.points = static_cast<std::size_t>(std::count_if(
      pairs.begin(), pairs.end(), [&](const Alike& p) { return agrees(p, match.T_AB.mean); }));
  if (match.points < kLeastAgreeing || !isCovariance(match.T_AB.covariance)) return std::nullopt;
  // Two points define the pose, so only the others are evidence.
  const auto others = static_cast<double>(match.points - 2);
  match.nats = -(logChoose(pairs.size(), 2) + logChoose(pairs.size() - 2, match.points - 2) +
                 others * std::log(chanceOf(pairs)));
  return match;
}

}  // namespace perdure::mapping

#include "common/replay/level_planes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace perdure::replay {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kSpacing_px = 16;  // distance between patches
constexpr int kHalf_px = 12;     // half size of a patch, which is 12 cm wide at 3 m
constexpr int kStep_px = 3;      // distance between the points of a patch
constexpr int kMost_mm = 10000;
constexpr double kNoise = 1.5e-3;  // noise of inverse depth, 1/m: 1.3 cm at 3 m
constexpr double kAbout_deg = 50.0, kMode_deg = 8.0, kAgree_deg = 5.0, kOther_deg = 20.0;
constexpr std::size_t kFewest = 100, kCandidates = 1000;

/// The normal of the patch around a pixel, in the camera frame, pointing towards the camera.
/// Returns nothing if depth is missing in more than a tenth of the patch, or if the patch is not
/// flat. The inverse depth of a plane is linear in the pixel, and its noise is the same at all
/// distances. A fit in space would bias the normals of slanted patches towards the camera, by half
/// a degree over a floor.
std::optional<Eigen::Vector3d> patchNormal(const cv::Mat& depth, const CameraCalibration& K,
                                           int row, int column) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0.0;
  int points = 0, all = 0;
  for (int r = row - kHalf_px; r <= row + kHalf_px; r += kStep_px) {
    for (int c = column - kHalf_px; c <= column + kHalf_px; c += kStep_px, ++all) {
      const int mm = depth.at<std::uint16_t>(r, c);
      if (mm == 0 || mm > kMost_mm) continue;
      const Eigen::Vector3d ray((c - K.cx) / K.fx, (r - K.cy) / K.fy, 1.0);
      const double inverse = 1e3 / mm;
      A += ray * ray.transpose(), b += inverse * ray, squares += inverse * inverse, ++points;
    }
  }
  if (10 * points < 9 * all) return std::nullopt;
  const Eigen::Vector3d plane = A.ldlt().solve(b);  // n / d of n · x = d
  const double residual = std::sqrt(std::max(0.0, squares - plane.dot(b)) / points);
  if (!(residual < 2.0 * kNoise) || !(plane.norm() > 1e-6)) return std::nullopt;
  return Eigen::Vector3d(-plane.normalized());  // d > 0: n points away from the camera
}

std::size_t countWithin(const std::vector<Eigen::Vector3d>& normals, const Eigen::Vector3d& axis,
                        double angle_deg) {
  const double least = std::cos(angle_deg * kRadians);
  return static_cast<std::size_t>(std::count_if(
      normals.begin(), normals.end(), [&](const auto& n) { return n.dot(axis) >= least; }));
}

struct Mode {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  std::size_t count = 0;
};

/// Returns the normal with the most neighbours, among the normals that `allowed` accepts.
Mode densest(const std::vector<Eigen::Vector3d>& normals, const auto& allowed) {
  Mode best;
  const std::size_t step = std::max<std::size_t>(1, normals.size() / kCandidates);
  for (std::size_t i = 0; i < normals.size(); i += step) {
    if (!allowed(normals[i])) continue;
    const std::size_t count = countWithin(normals, normals[i], kMode_deg);
    if (count > best.count) best = {normals[i], count};
  }
  return best;
}

/// Returns the mean of the normals within `angle_deg` of `axis`. It is repeated with the mean as
/// the axis.
Eigen::Vector3d settled(const std::vector<Eigen::Vector3d>& normals, Eigen::Vector3d axis,
                        double angle_deg) {
  constexpr int kRounds = 20;
  const double least = std::cos(angle_deg * kRadians);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& n : normals) {
      if (n.dot(axis) >= least) sum += n;
    }
    if (sum.norm() < 0.5) break;
    axis = sum.normalized();
  }
  return axis;
}

}  // namespace

void LevelPlanes::add(const cv::Mat& depth, const CameraCalibration& K,
                      const Eigen::Matrix3d& R_PC) {
  for (int r = kHalf_px; r < depth.rows - kHalf_px; r += kSpacing_px) {
    for (int c = kHalf_px; c < depth.cols - kHalf_px; c += kSpacing_px) {
      if (const auto normal = patchNormal(depth, K, r, c)) normals_P_.push_back(R_PC * *normal);
    }
  }
}

Result<UpEstimate> LevelPlanes::up(const Eigen::Vector3d& about) const {
  const Eigen::Vector3d near = about.normalized();
  const double cone = std::cos(kAbout_deg * kRadians), apart = std::cos(kOther_deg * kRadians);
  std::vector<Eigen::Vector3d> upward;
  for (const auto& n : normals_P_) {
    if (n.dot(near) >= cone) upward.push_back(n);
  }
  const Mode best = densest(upward, [](const auto&) { return true; });
  if (best.count < kFewest) {
    return fail("planes_none", std::to_string(best.count) + " patches of " +
                                   std::to_string(normals_P_.size()) + " agree on a level plane");
  }
  const Mode other = densest(upward, [&](const auto& n) { return n.dot(best.axis) < apart; });
  if (3 * other.count > 2 * best.count) {
    return fail("planes_ambiguous", "two planes may be level: " + std::to_string(best.count) +
                                        " patches speak for one, " + std::to_string(other.count) +
                                        " for another");
  }
  UpEstimate result;
  result.up = settled(normals_P_, settled(normals_P_, best.axis, kMode_deg), kAgree_deg);
  result.patches = countWithin(normals_P_, result.up, kAgree_deg);
  result.all = normals_P_.size();
  return result;
}

}  // namespace perdure::replay

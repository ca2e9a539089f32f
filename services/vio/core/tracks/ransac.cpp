#include "services/vio/core/tracks/ransac.h"

#include <Eigen/Geometry>
#include <cstdint>

namespace perdure::vio {
namespace {

/// Returns the distance in pixels of `m.now` from the line through `turned` along the translation
/// `t`.
double lineDistance(const Eigen::Vector3d& turned, const Match& m, const Eigen::Vector3d& t) {
  const Eigen::Vector3d line = t.cross(turned);
  const double norm = line.head<2>().norm();
  if (norm < 1e-12) return (turned.hnormalized() - m.now).norm() * m.scale;
  return std::abs(line.dot(m.now.homogeneous())) / norm * m.scale;
}

}  // namespace

double epipolarDistance(const Match& match, const Eigen::Matrix3d& R_now_before,
                        const Eigen::Vector3d& translation) {
  return lineDistance(R_now_before * match.before.homogeneous(), match, translation);
}

std::vector<bool> twoPointRansac(const std::vector<Match>& matches,
                                 const Eigen::Matrix3d& R_now_before, double threshold_px) {
  constexpr int kIterations = 100;
  const std::size_t n = matches.size();
  std::vector<bool> best(n, true);
  if (n < 4) return best;
  std::vector<Eigen::Vector3d> turned(n), normals(n);
  std::vector<bool> still(n);  // matches without parallax agree with every translation
  for (std::size_t i = 0; i < n; ++i) {
    turned[i] = R_now_before * matches[i].before.homogeneous();
    normals[i] = turned[i].cross(Eigen::Vector3d(matches[i].now.homogeneous()));
    still[i] = turned[i].z() > 1e-6 &&
               (turned[i].hnormalized() - matches[i].now).norm() * matches[i].scale < threshold_px;
  }
  std::uint64_t seed = 0x9e3779b97f4a7c15ull;
  const auto next = [&seed, n] {
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<std::size_t>((seed >> 33) % n);
  };
  std::size_t best_count = 0;
  std::vector<bool> agrees(n);
  for (int k = 0; k < kIterations && best_count < n; ++k) {
    const std::size_t i = next(), j = next();
    if (i == j) continue;
    const Eigen::Vector3d t = normals[i].cross(normals[j]);
    if (t.norm() < 1e-12) continue;
    std::size_t count = 0;
    for (std::size_t m = 0; m < n; ++m) {
      agrees[m] = still[m] || lineDistance(turned[m], matches[m], t) < threshold_px;
      count += agrees[m];
    }
    if (count > best_count) {
      best_count = count;
      best = agrees;
    }
  }
  return best;
}

}  // namespace perdure::vio

#include "services/vio/core/tracks/patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace perdure::vio {
namespace {

constexpr int kSteps = 10;
constexpr float kSettled = 0.01F;        // px; a smaller step ends the search
constexpr float kLeastDeviation = 2.0F;  // grey levels; less texture is noise
constexpr float kFarthest = 4.0F;        // px from the seed
// Damping of affine terms, grey levels² per (pixel at the rim)². With little texture, it preserves
// the warp.
constexpr float kAffineDamping = 600.0F;

using Values = Eigen::Matrix<float, Patch::kPixels, 1>;

/// Samples the warped patch. Returns false if the patch exceeds the image.
bool sample(const cv::Mat& image, const Eigen::Matrix2f& warp, const Eigen::Vector2f& centre,
            Values& out) {
  constexpr float h = Patch::kHalf, kRounding = 0.01F;
  const Eigen::Vector2f reach = (h * warp.cwiseAbs().rowwise().sum()).array() + kRounding;
  if (!(centre.x() - reach.x() >= 0) || !(centre.y() - reach.y() >= 0) ||
      !(centre.x() + reach.x() < static_cast<float>(image.cols - 1)) ||
      !(centre.y() + reach.y() < static_cast<float>(image.rows - 1))) {
    return false;
  }
  // Samples column by column, in loops over a fixed number of rows. Rows beyond the patch repeat
  // its last row.
  constexpr std::size_t kRows = 16;
  static_assert(kRows >= Patch::kSide);
  std::array<float, kRows> px, py, a, b;
  for (std::size_t r = 0; r < kRows; ++r) {
    const float y = std::min(static_cast<float>(r), 2 * h) - h;
    px[r] = centre.x() + (warp(0, 0) * -h + warp(0, 1) * y);
    py[r] = centre.y() + (warp(1, 0) * -h + warp(1, 1) * y);
  }
  std::array<int, kRows> u, v, top_left, top_right, low_left, low_right;
  std::array<float, kRows> value;
  for (int x = 0; x < Patch::kSide; ++x) {
    for (std::size_t r = 0; r < kRows; ++r) {
      u[r] = static_cast<int>(px[r]);
      v[r] = static_cast<int>(py[r]);
      a[r] = px[r] - static_cast<float>(u[r]);
      b[r] = py[r] - static_cast<float>(v[r]);
      px[r] += warp(0, 0);
      py[r] += warp(1, 0);
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      const std::uint8_t* top = image.ptr<std::uint8_t>(v[r]) + u[r];
      const std::uint8_t* low = top + image.step;
      top_left[r] = top[0], top_right[r] = top[1];
      low_left[r] = low[0], low_right[r] = low[1];
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      const float upper =
          static_cast<float>(top_left[r]) + a[r] * static_cast<float>(top_right[r] - top_left[r]);
      const float lower =
          static_cast<float>(low_left[r]) + a[r] * static_cast<float>(low_right[r] - low_left[r]);
      value[r] = upper + b[r] * (lower - upper);
    }
    for (int r = 0; r < Patch::kSide; ++r) {
      out[r * Patch::kSide + x] = value[static_cast<std::size_t>(r)];
    }
  }
  return true;
}

/// Subtracts the mean, and returns the norm of the result.
float centre(Values& values) {
  values.array() -= values.mean();
  return values.norm();
}

}  // namespace

std::optional<Patch> Patch::cut(const cv::Mat& image, const cv::Point2f& pixel) {
  Patch p;
  const Eigen::Vector2f at(pixel.x, pixel.y);
  const Eigen::Matrix2f I = Eigen::Matrix2f::Identity();
  Values left, right, up, down;
  if (!sample(image, I, at, p.value_) || !sample(image, I, at - Eigen::Vector2f::UnitX(), left) ||
      !sample(image, I, at + Eigen::Vector2f::UnitX(), right) ||
      !sample(image, I, at - Eigen::Vector2f::UnitY(), up) ||
      !sample(image, I, at + Eigen::Vector2f::UnitY(), down)) {
    return std::nullopt;
  }
  p.norm_ = centre(p.value_);
  if (p.norm_ < kLeastDeviation * kSide) return std::nullopt;
  Eigen::Index i = 0;
  for (int y = -kHalf; y <= kHalf; ++y) {
    for (int x = -kHalf; x <= kHalf; ++x, ++i) {
      const float gx = 0.5F * (right[i] - left[i]), gy = 0.5F * (down[i] - up[i]);
      // Affine terms are expressed as displacements at the rim, so that all six are in pixels.
      const float u = static_cast<float>(x) / kHalf, v = static_cast<float>(y) / kHalf;
      p.steepest_.row(i) << gx, gy, gx * u, gx * v, gy * u, gy * v;
    }
  }
  // An offset of brightness must not affect the fit.
  p.steepest_.rowwise() -= p.steepest_.colwise().mean().eval();
  Eigen::Matrix<float, 6, 6> H = p.steepest_.transpose() * p.steepest_;
  H.diagonal().tail<4>().array() += kAffineDamping;
  const Eigen::LLT<Eigen::Matrix<float, 6, 6>> llt(H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  p.inverse_hessian_ = llt.solve(Eigen::Matrix<float, 6, 6>::Identity());
  return p;
}

float Patch::growth() const { return std::sqrt(std::abs(warp_.determinant())); }

std::optional<Patch::Found> Patch::find(const std::vector<cv::Mat>& levels,
                                        const cv::Point2f& seed) {
  // A patch that has grown is searched for in a smaller image, in which it has its first size.
  const int last = static_cast<int>(levels.size()) - 1;
  const int level =
      std::clamp(static_cast<int>(std::lround(std::log2(std::max(growth(), 1.0F)))), 0, last);
  const float scale = static_cast<float>(1 << level);
  const cv::Mat& image = levels[static_cast<std::size_t>(level)];
  Eigen::Matrix2f warp = warp_ / scale;
  const Eigen::Vector2f from = Eigen::Vector2f(seed.x, seed.y) / scale;
  Eigen::Vector2f at = from;
  Values now;
  for (int k = 0; k < kSteps; ++k) {
    if (!sample(image, warp, at, now)) return std::nullopt;
    const float norm = centre(now);
    if (!(norm > 0)) return std::nullopt;
    const Values difference = norm_ / norm * now - value_;
    const Eigen::Matrix<float, 6, 1> d = inverse_hessian_ * (steepest_.transpose() * difference);
    Eigen::Matrix2f step;
    step << d[2], d[3], d[4], d[5];
    warp = warp * (Eigen::Matrix2f::Identity() + step / kHalf).inverse();
    const Eigen::Vector2f moved = warp * d.head<2>();
    at -= moved;
    if (!((at - from).norm() * scale < kFarthest)) return std::nullopt;
    if (moved.norm() * scale >= kSettled) continue;
    if (!sample(image, warp, at, now)) return std::nullopt;
    const float rest = centre(now);
    if (!(rest > 0)) return std::nullopt;
    warp_ = scale * warp;
    return Found{{at.x() * scale, at.y() * scale}, now.dot(value_) / (rest * norm_)};
  }
  return std::nullopt;
}

}  // namespace perdure::vio

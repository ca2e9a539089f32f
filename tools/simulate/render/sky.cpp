#include "tools/simulate/render/sky.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/render/counter_noise.h"

namespace perdure::tools {
namespace {

constexpr int kSize = 768;  ///< side of the sky map
constexpr float kCeilingHeight = 3.2F, kCeilingTile = 0.6F;

float lattice(std::uint64_t seed, int x, int y) {
  const auto cell = static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
                    static_cast<std::uint32_t>(y);
  return uniformOf(mixBits(seed, cell));
}

float smooth(float t) { return t * t * (3.0F - 2.0F * t); }

/// Smooth value noise in [0, 1].
float noiseAt(std::uint64_t seed, float x, float y) {
  const float fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const float u = smooth(x - fx), v = smooth(y - fy);
  const float low = std::lerp(lattice(seed, ix, iy), lattice(seed, ix + 1, iy), u);
  const float high = std::lerp(lattice(seed, ix, iy + 1), lattice(seed, ix + 1, iy + 1), u);
  return std::lerp(low, high, v);
}

float cloudsAt(std::uint64_t seed, const Eigen::Vector3f& d) {
  const float scale = 1.6F / (d.z() + 0.12F);
  float x = d.x() * scale, y = d.y() * scale, sum = 0.0F, weight = 0.5F;
  for (int octave = 0; octave < 5; ++octave) {
    sum += weight * noiseAt(mixBits(seed, static_cast<std::uint64_t>(octave)), x, y);
    x *= 2.1F, y *= 2.1F, weight *= 0.5F;
  }
  return smooth(std::clamp((sum - 0.45F) * 4.0F, 0.0F, 1.0F));
}

}  // namespace

Sky::Sky(const sim::Scene& scene)
    : indoors_(scene.ground == sim::GroundKind::kRoom),
      strength_(static_cast<float>(scene.sky_strength)),
      sun_W_(scene.sun_W.normalized().cast<float>()),
      horizon_(0.80F, 0.86F, 0.95F) {
  horizon_ *= 1.5F * strength_;
  if (!indoors_) paintOutdoors(mixBits(scene.seed, 0x5b1));
}

void Sky::paintOutdoors(std::uint64_t seed) {
  const Eigen::Vector3f zenith = Eigen::Vector3f(0.32F, 0.52F, 0.95F) * (1.1F * strength_);
  const Eigen::Vector3f cloud = Eigen::Vector3f(1.0F, 0.99F, 0.97F) * (2.2F * strength_);
  map_.reserve(static_cast<std::size_t>(kSize * kSize));
  for (int row = 0; row < kSize; ++row) {
    for (int column = 0; column < kSize; ++column) {
      const float x = (static_cast<float>(column) + 0.5F) * 2.0F / kSize - 1.0F;
      const float y = (static_cast<float>(row) + 0.5F) * 2.0F / kSize - 1.0F;
      const float r2 = std::min(x * x + y * y, 1.0F);
      const Eigen::Vector3f d =
          Eigen::Vector3f(2.0F * x, 2.0F * y, 1.0F - r2).normalized();  // corners: the horizon
      const Eigen::Vector3f clear = horizon_ + (zenith - horizon_) * std::sqrt(d.z());
      const float share = 0.85F * cloudsAt(seed, d);
      const float glow = std::pow(std::max(0.0F, d.dot(sun_W_)), 60.0F);
      const Eigen::Vector3f light = clear + (cloud - clear) * share +
                                    Eigen::Vector3f(1.0F, 0.9F, 0.7F) * (2.0F * glow * strength_);
      map_.emplace_back(light.x(), light.y(), light.z(), 0.0F);
    }
  }
}

Eigen::Vector3f Sky::radiance(const Eigen::Vector3f& origin_W, const Eigen::Vector3f& d_W) const {
  return indoors_ ? ceiling(origin_W, d_W) : outdoors(d_W);
}

Eigen::Vector3f Sky::outdoors(const Eigen::Vector3f& d) const {
  // Directions below the horizon get the colour of the horizon.
  const float scale = 1.0F / (d.z() > 0.0F ? 1.0F + d.z() : d.head<2>().norm() + 1e-6F);
  const auto place = [&](float t) {
    return std::clamp((t * scale + 1.0F) * (0.5F * kSize) - 0.5F, 0.0F, kSize - 1.001F);
  };
  const float x = place(d.x()), y = place(d.y());
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float u = x - static_cast<float>(column), v = y - static_cast<float>(row);
  const Eigen::Vector4f* low = &map_[static_cast<std::size_t>(row * kSize + column)];
  const Eigen::Vector4f* high = low + kSize;
  const Eigen::Vector4f light =
      (1.0F - v) * ((1.0F - u) * low[0] + u * low[1]) + v * ((1.0F - u) * high[0] + u * high[1]);
  return light.head<3>();
}

Eigen::Vector3f Sky::ceiling(const Eigen::Vector3f& origin, const Eigen::Vector3f& d) const {
  const Eigen::Vector3f plain = Eigen::Vector3f(0.75F, 0.74F, 0.72F) * (0.8F * strength_);
  if (d.z() < 0.02F) return plain;
  const Eigen::Vector3f at = origin + d * ((kCeilingHeight - origin.z()) / d.z());
  const float x = at.x() / kCeilingTile, y = at.y() / kCeilingTile;
  const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
  if ((column % 5 + 5) % 5 == 2 && (row % 4 + 4) % 4 == 1) return plain * 6.0F;
  const float edge = std::min(std::min(x - std::floor(x), std::ceil(x) - x),
                              std::min(y - std::floor(y), std::ceil(y) - y));
  const float tone = 0.92F + 0.08F * lattice(0x7117, column, row);
  // Blurs lines that are narrower than a pixel at this distance.
  const float blur = 0.0025F * (at - origin).norm() / (d.z() * kCeilingTile) + 1e-3F;
  const float line =
      std::clamp((0.03F + 0.5F * blur - edge) / blur, 0.0F, 1.0F) * std::min(1.0F, 0.06F / blur);
  return plain * (tone + (0.45F - tone) * line);
}

}  // namespace perdure::tools

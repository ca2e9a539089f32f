// Noise with period 1: value noise on a lattice of fx × fy cells, and sums of its octaves.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace perdure::tools::shapes {

/// Returns a number in [0, 1) that depends on cell and seed only.
inline float cellNoise(int x, int y, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8DA6B343U ^
                    static_cast<std::uint32_t>(y) * 0xD8163841U ^ seed * 0xCB1AB31FU;
  h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 12U)) * 0x297A2D39U;
  h ^= h >> 15U;
  return static_cast<float>(h >> 8U) * 0x1.0p-24F;
}

inline int wrapCell(int i, int period) {
  const int m = i % period;
  return m < 0 ? m + period : m;
}

/// Value noise in [0, 1), smooth in u and v with period 1; fx, fy > 0 are numbers of cells.
inline float valueNoise(float u, float v, int fx, int fy, std::uint32_t seed) {
  const float x = u * static_cast<float>(fx), y = v * static_cast<float>(fy);
  const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
  const float ax = x - static_cast<float>(ix), ay = y - static_cast<float>(iy);
  const float sx = ax * ax * (3.0F - 2.0F * ax), sy = ay * ay * (3.0F - 2.0F * ay);
  const int x0 = wrapCell(ix, fx), x1 = wrapCell(ix + 1, fx);
  const int y0 = wrapCell(iy, fy), y1 = wrapCell(iy + 1, fy);
  const float a = cellNoise(x0, y0, seed), b = cellNoise(x1, y0, seed);
  const float c = cellNoise(x0, y1, seed), d = cellNoise(x1, y1, seed);
  const float low = a + (b - a) * sx;
  return low + (c + (d - c) * sx - low) * sy;
}

/// Normalised sum of octaves, each with half the amplitude and twice the frequency; [0, 1), mean
/// 0.5.
inline float octaves(float u, float v, int fx, int fy, int count, std::uint32_t seed) {
  float sum = 0.0F, weight = 1.0F, total = 0.0F;
  for (int i = 0; i < count; ++i) {
    sum += weight * valueNoise(u, v, fx << i, fy << i, seed + static_cast<std::uint32_t>(i));
    total += weight;
    weight *= 0.5F;
  }
  return sum / total;
}

/// Distance in cells to the nearest grid line, for a coordinate in cells.
inline float toLine(float cells) {
  const float part = cells - std::floor(cells);
  return std::min(part, 1.0F - part);
}

}  // namespace perdure::tools::shapes

// A texture as a function of (u, v) in [0, 1)², with period 1: linear RGB.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>

namespace perdure::tools::shapes {

using Colour = Eigen::Vector3f;
using Pattern = std::function<Colour(float u, float v)>;

inline Colour mix(const Colour& a, const Colour& b, float share) {
  return a + std::clamp(share, 0.0F, 1.0F) * (b - a);
}
/// 0 below `from`, 1 above `to`, smooth between them.
inline float smoothStep(float from, float to, float x) {
  const float s = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return s * s * (3.0F - 2.0F * s);
}

}  // namespace perdure::tools::shapes

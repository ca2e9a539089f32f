// Patterns of textures: linear RGB as a function of (u, v) in [0, 1)², with period 1.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>

#include "tools/simulate/shapes/dice.h"

namespace perdure::tools::shapes {

using Colour = Eigen::Vector3f;
using Pattern = std::function<Colour(float u, float v)>;

inline Colour mix(const Colour& a, const Colour& b, float share) {
  return a + std::clamp(share, 0.0F, 1.0F) * (b - a);
}
/// Returns 0 below `from`, 1 above `to`, and a smooth value in between.
inline float smoothStep(float from, float to, float x) {
  const float s = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return s * s * (3.0F - 2.0F * s);
}

// Patterns of grounds, roads, floors and wood.
Pattern asphaltPattern(Dice& dice);
Pattern pavingPattern(Dice& dice);
Pattern grassPattern(Dice& dice);
Pattern earthPattern(Dice& dice);
Pattern tilesPattern(Dice& dice);
Pattern markingsPattern(Dice& dice);
Pattern woodPattern(Dice& dice);
Pattern timberPattern(Dice& dice);

// Patterns of walls, plants, cloth, metal and screens.
Pattern brickPattern(Dice& dice);
Pattern plasterPattern(Dice& dice);
Pattern windowsPattern(Dice& dice);
Pattern barkPattern(Dice& dice);
Pattern leavesPattern(Dice& dice);
Pattern fabricPattern(Dice& dice);
Pattern metalPattern(Dice& dice);
Pattern carPaintPattern(Dice& dice);
Pattern screenPattern(Dice& dice);
Pattern skinPattern(Dice& dice);
Pattern booksPattern(Dice& dice);
Pattern signPattern(Dice& dice);
Pattern paintingPattern(Dice& dice);

}  // namespace perdure::tools::shapes

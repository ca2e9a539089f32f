#include "tools/simulate/shapes/patterns/patterns.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/patterns/ground_patterns.h"
#include "tools/simulate/shapes/patterns/noise.h"
#include "tools/simulate/shapes/patterns/surface_patterns.h"

namespace perdure::tools::shapes {
namespace {

Pattern patternOf(TextureKind kind, std::uint64_t seed) {
  Dice dice(seed ^ (static_cast<std::uint64_t>(kind) << 40U));
  switch (kind) {
    case TextureKind::kAsphalt:
      return asphaltPattern(dice);
    case TextureKind::kPaving:
      return pavingPattern(dice);
    case TextureKind::kGrass:
      return grassPattern(dice);
    case TextureKind::kEarth:
      return earthPattern(dice);
    case TextureKind::kTiles:
      return tilesPattern(dice);
    case TextureKind::kMarkings:
      return markingsPattern(dice);
    case TextureKind::kWood:
      return woodPattern(dice);
    case TextureKind::kTimber:
      return timberPattern(dice);
    case TextureKind::kPainting:
      return paintingPattern(dice);
    case TextureKind::kSign:
      return signPattern(dice);
    case TextureKind::kBrick:
      return brickPattern(dice);
    case TextureKind::kPlaster:
      return plasterPattern(dice);
    case TextureKind::kWindows:
      return windowsPattern(dice);
    case TextureKind::kBark:
      return barkPattern(dice);
    case TextureKind::kLeaves:
      return leavesPattern(dice);
    case TextureKind::kFabric:
      return fabricPattern(dice);
    case TextureKind::kMetal:
      return metalPattern(dice);
    case TextureKind::kCarPaint:
      return carPaintPattern(dice);
    case TextureKind::kScreen:
      return screenPattern(dice);
    case TextureKind::kSkin:
      return skinPattern(dice);
    case TextureKind::kBooks:
      return booksPattern(dice);
  }
  throw std::invalid_argument("a kind of texture that is not known");
}

}  // namespace

std::vector<Eigen::Vector3f> paintPattern(TextureKind kind, std::uint64_t seed, int size) {
  const Pattern pattern = patternOf(kind, seed);
  std::vector<Eigen::Vector3f> texels;
  texels.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const float step = 1.0F / static_cast<float>(size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector3f colour =
          pattern((static_cast<float>(x) + 0.5F) * step, (static_cast<float>(y) + 0.5F) * step);
      texels.push_back(colour.cwiseMax(0.0F).cwiseMin(1.0F));
    }
  }
  return texels;
}

}  // namespace perdure::tools::shapes

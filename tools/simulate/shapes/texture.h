// Procedural textures from a seed, with mip maps that prevent flicker at a distance.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace perdure::tools {

/// Plaster, fabric, metal, car paint, skin and markings are nearly white and tinted; others have
/// their own colours.
enum class TextureKind {
  kAsphalt,
  kPaving,
  kGrass,
  kBrick,
  kPlaster,
  kWindows,
  kBark,
  kLeaves,
  kWood,
  kFabric,
  kMetal,
  kCarPaint,
  kScreen,
  kSkin,
  kMarkings,
  kTiles,
  kEarth,
  kBooks,
  kTimber,
  kPainting,
  kSign
};

class Texture {
 public:
  /// Paints size × size tileable texels. Throws std::invalid_argument unless size is a power of two
  /// from 1 to 4096.
  Texture(TextureKind kind, std::uint64_t seed, int size = 256);
  /// Trilinear sample, linear RGB. `footprint`: width of the pixel in repeats; uv wraps.
  Eigen::Vector3f sample(const Eigen::Vector2f& uv, float footprint) const;

 private:
  using Texel = std::array<std::uint8_t, 4>;  ///< square root of RGB, for dark tones
  struct Level {
    int size = 0;
    std::vector<Texel> texels;
  };
  static Eigen::Vector3f bilinear(const Level& level, float u, float v);
  std::vector<Level> levels_;
};

/// Returns the texture; calls with equal kind, seed and size share one.
std::shared_ptr<const Texture> makeTexture(TextureKind kind, std::uint64_t seed, int size = 256);

}  // namespace perdure::tools

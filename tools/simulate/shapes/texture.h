// Procedural pictures, made from a seed, with mip maps so that distance does not make them flicker.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace perdure::tools {

/// Paving, brick, bark, leaves, wood (boards), timber, books, screens and the grounds bring their
/// own colours; plaster, fabric, metal, car paint, skin and markings are nearly white, to be tinted
/// by the material.
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
  /// size × size texels, tileable; size is a power of two from 1 to 4096, else
  /// std::invalid_argument.
  Texture(TextureKind kind, std::uint64_t seed, int size = 256);
  /// Linear RGB, bilinear within and linear between levels; `footprint` is the width of the pixel
  /// in texture repeats. uv wraps.
  Eigen::Vector3f sample(const Eigen::Vector2f& uv, float footprint) const;

 private:
  using Texel = std::array<std::uint8_t, 4>;  ///< RGB by square root, so that dark tones keep steps
  struct Level {
    int size = 0;
    std::vector<Texel> texels;
  };
  static Eigen::Vector3f bilinear(const Level& level, float u, float v);
  std::vector<Level> levels_;
};

/// Shared where kind, seed and size are the same.
std::shared_ptr<const Texture> makeTexture(TextureKind kind, std::uint64_t seed, int size = 256);

}  // namespace perdure::tools

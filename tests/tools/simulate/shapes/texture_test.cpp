// Tests the generated textures: they tile, keep their mean, depend only on their seed, and are
// shared.
#include "tools/simulate/shapes/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace perdure::tools {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::array kTiling{
    TextureKind::kAsphalt,  TextureKind::kPaving, TextureKind::kGrass,    TextureKind::kBrick,
    TextureKind::kPlaster,  TextureKind::kBark,   TextureKind::kLeaves,   TextureKind::kWood,
    TextureKind::kFabric,   TextureKind::kMetal,  TextureKind::kCarPaint, TextureKind::kSkin,
    TextureKind::kMarkings, TextureKind::kTiles,  TextureKind::kEarth,    TextureKind::kTimber};

/// Returns the ratio of the seam's step to the largest step inside, for a texture that is cut off
/// at `share` and repeated.
float seamOf(const Texture& texture, float share, bool rows) {
  constexpr int kSteps = 128;
  const float step = share / kSteps;
  float steepest = 0.0F, seam = 0.0F;
  for (int i = 0; i < kSteps; ++i) {
    const float a = (static_cast<float>(i) + 0.5F) * step;
    const float next = i + 1 == kSteps ? 0.5F * step : a + step;
    seam = 0.0F;
    for (int j = 0; j < kSteps; ++j) {
      const float b = (static_cast<float>(j) + 0.5F) / kSteps;
      const Vector2f here = rows ? Vector2f(b, a) : Vector2f(a, b);
      const Vector2f there = rows ? Vector2f(b, next) : Vector2f(next, b);
      seam += (texture.sample(here, 1.0F / kSteps) - texture.sample(there, 1.0F / kSteps)).norm();
    }
    if (i + 1 < kSteps) steepest = std::max(steepest, seam);
  }
  return seam / steepest;
}

TEST(Textures, ContinueFromTheRightEdgeToTheLeftAndFromTopToBottom) {
  for (const TextureKind kind : kTiling) {
    for (const std::uint64_t seed : {3U, 8U}) {
      const Texture texture(kind, seed, 256);
      EXPECT_LE(seamOf(texture, 1.0F, false), 1.05F) << "columns of " << static_cast<int>(kind);
      EXPECT_LE(seamOf(texture, 1.0F, true), 1.05F) << "rows of " << static_cast<int>(kind);
    }
  }
}

TEST(Textures, CutOffBeforeTheirEndShowASeam) {
  for (const TextureKind kind : {TextureKind::kGrass, TextureKind::kLeaves, TextureKind::kCarPaint,
                                 TextureKind::kSkin, TextureKind::kEarth}) {
    const Texture texture(kind, 3, 256);
    EXPECT_GT(seamOf(texture, 5.0F / 6.0F, false), 1.2F) << static_cast<int>(kind);
    EXPECT_GT(seamOf(texture, 5.0F / 6.0F, true), 1.2F) << static_cast<int>(kind);
  }
}

TEST(Textures, KeepTheirMeanFromLevelToLevel) {
  for (int kind = 0; kind <= static_cast<int>(TextureKind::kSign); ++kind) {
    constexpr int kSize = 64;
    const Texture texture(static_cast<TextureKind>(kind), 5, kSize);
    Vector3f mean = Vector3f::Zero();
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const Vector2f uv((static_cast<float>(x) + 0.5F) / kSize,
                          (static_cast<float>(y) + 0.5F) / kSize);
        mean += texture.sample(uv, 0.0F) / (kSize * kSize);
      }
    }
    const Vector3f whole = texture.sample(Vector2f(0.3F, 0.7F), 1.0F);
    EXPECT_LT((whole - mean).cwiseAbs().maxCoeff(), 0.005F) << "kind " << kind;
    const Vector3f beyond = texture.sample(Vector2f(0.9F, 0.2F), 40.0F);
    EXPECT_LT((beyond - whole).norm(), 1e-5F) << "kind " << kind;
  }
}

TEST(Textures, WrapAndFollowFromTheirSeed) {
  const Texture a(TextureKind::kPaving, 1, 128), again(TextureKind::kPaving, 1, 128),
      other(TextureKind::kPaving, 2, 128);
  float difference = 0.0F;
  for (int i = 0; i < 50; ++i) {
    const Vector2f uv(0.02F * static_cast<float>(i), 0.5F);
    EXPECT_EQ(a.sample(uv, 0.01F), again.sample(uv, 0.01F));
    EXPECT_LT((a.sample(uv, 0.01F) - a.sample(uv + Vector2f(3.0F, -2.0F), 0.01F)).norm(), 1e-3F);
    difference += (a.sample(uv, 0.01F) - other.sample(uv, 0.01F)).norm();
  }
  EXPECT_GT(difference, 1.0F);
}

TEST(Textures, AreSharedAndRefuseSizesThatHaveNoMipMaps) {
  const auto a = makeTexture(TextureKind::kBrick, 4, 64);
  EXPECT_EQ(a, makeTexture(TextureKind::kBrick, 4, 64));
  EXPECT_NE(a, makeTexture(TextureKind::kBrick, 5, 64));
  EXPECT_NE(a, makeTexture(TextureKind::kBrick, 4, 128));
  EXPECT_THROW(Texture(TextureKind::kBrick, 4, 100), std::invalid_argument);
  EXPECT_THROW(Texture(TextureKind::kBrick, 4, 0), std::invalid_argument);
}

}  // namespace
}  // namespace perdure::tools

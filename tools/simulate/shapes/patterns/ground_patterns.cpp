#include <cmath>
#include <cstdint>

#include "tools/simulate/shapes/patterns/noise.h"
#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools::shapes {
namespace {

/// Thin dark lines along the median contour of the noise, in some places only.
float cracks(float u, float v, std::uint32_t seed) {
  const float ridge = std::abs(octaves(u, v, 3, 3, 4, seed) - 0.5F);
  const float where = smoothStep(0.5F, 0.62F, valueNoise(u, v, 4, 4, seed + 71U));
  return where * (1.0F - smoothStep(0.002F, 0.007F, ridge));
}

}  // namespace

Pattern asphaltPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const float tone = dice.uniform(0.13F, 0.2F), warmth = dice.uniform(-0.03F, 0.05F);
  return [=](float u, float v) {
    const float broad = octaves(u, v, 3, 3, 4, seed);
    const float stones = valueNoise(u, v, 220, 220, seed + 11U);
    const float grit = cellNoise(static_cast<int>(u * 512.0F), static_cast<int>(v * 512.0F), seed);
    float light = tone * (0.62F + 0.55F * broad) * (0.7F + 0.6F * stones);
    if (grit > 0.93F) light *= 1.9F;
    if (grit < 0.1F) light *= 0.45F;
    const float spots = octaves(u, v, 24, 24, 3, seed + 23U);
    light *= 1.0F - 0.45F * smoothStep(0.62F, 0.75F, spots);
    light *= 1.0F - 0.75F * cracks(u, v, seed + 37U);
    return Colour(light * (1.0F + warmth), light, light * (1.0F - warmth));
  };
}

Pattern pavingPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const int rows = 4 + 2 * dice.below(3), columns = dice.chance(0.5F) ? rows : rows / 2;
  const float tone = dice.uniform(0.3F, 0.45F), red = dice.chance(0.3F) ? 0.14F : 0.03F;
  const bool staggered = dice.chance(0.6F);
  return [=](float u, float v) {
    const float y = v * static_cast<float>(rows);
    const int row = static_cast<int>(y);
    const float shift = staggered && row % 2 == 1 ? 0.5F : 0.0F;
    const float x = u * static_cast<float>(columns) + shift;
    const int column = wrapCell(static_cast<int>(std::floor(x)), columns);
    const float slab = cellNoise(column, row, seed);
    float light =
        tone * (0.7F + 0.5F * slab) * (0.75F + 0.5F * octaves(u, v, 40, 40, 4, seed + 5U));
    const float grit = cellNoise(static_cast<int>(u * 512.0F), static_cast<int>(v * 512.0F), seed);
    if (grit > 0.95F) light *= 1.35F;
    if (grit < 0.06F) light *= 0.6F;
    light *= 1.0F - 0.35F * smoothStep(0.58F, 0.7F, octaves(u, v, 5, 5, 4, seed + 9U));
    const float joint =
        std::min(toLine(x) * static_cast<float>(rows) / static_cast<float>(columns), toLine(y));
    light *= 0.35F + 0.65F * smoothStep(0.012F, 0.035F, joint);
    return Colour(light * (1.0F + red), light, light * (1.0F - red));
  };
}

Pattern grassPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour fresh(dice.uniform(0.09F, 0.13F), dice.uniform(0.15F, 0.2F), 0.045F);
  const Colour dry(0.3F, 0.27F, 0.12F), earth(0.14F, 0.1F, 0.06F);
  return [=](float u, float v) {
    const float blades = valueNoise(u, v, 230, 90, seed) * valueNoise(u, v, 90, 230, seed + 3U);
    const float clumps = octaves(u, v, 9, 9, 4, seed + 7U);
    Colour c = mix(fresh, dry, smoothStep(0.5F, 0.75F, clumps) * 0.7F);
    c = mix(c, earth, smoothStep(0.6F, 0.68F, octaves(u, v, 6, 6, 5, seed + 13U)));
    c *= 0.45F + 1.7F * blades + 0.3F * clumps;
    const float flower =
        cellNoise(static_cast<int>(u * 128.0F), static_cast<int>(v * 128.0F), seed);
    return flower > 0.997F ? Colour(0.75F, 0.72F, 0.4F) : c;
  };
}

Pattern earthPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour light(0.33F, 0.26F, 0.18F), dark(0.13F, 0.1F, 0.07F);
  return [=](float u, float v) {
    const Colour c = mix(dark, light, octaves(u, v, 5, 5, 6, seed));
    const float stone = valueNoise(u, v, 60, 60, seed + 3U);
    return Colour(c * (0.7F + 0.6F * smoothStep(0.6F, 0.8F, stone)));
  };
}

Pattern tilesPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const int count = 4 + 2 * dice.below(2);
  const bool chequered = dice.chance(0.3F);
  const Colour base(dice.uniform(0.4F, 0.62F), dice.uniform(0.38F, 0.58F),
                    dice.uniform(0.34F, 0.55F));
  const Colour other = base * dice.uniform(0.3F, 0.6F);
  return [=](float u, float v) {
    const float x = u * static_cast<float>(count), y = v * static_cast<float>(count);
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    Colour c = chequered && (i + j) % 2 == 1 ? other : base;
    c *= 0.85F + 0.25F * cellNoise(i, j, seed);
    const float vein = std::abs(octaves(u, v, 7, 7, 5, seed + 3U) - 0.5F);
    c *= 0.72F + 0.28F * smoothStep(0.0F, 0.03F, vein);
    c *= 0.88F + 0.24F * octaves(u, v, 32, 32, 3, seed + 17U);
    return Colour(c * (0.35F + 0.65F * smoothStep(0.012F, 0.03F, std::min(toLine(x), toLine(y)))));
  };
}

Pattern markingsPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const float wear = dice.uniform(0.6F, 0.75F);
  return [=](float u, float v) {
    const float worn = octaves(u, v, 12, 12, 5, seed);
    const float light = 0.85F - 0.62F * smoothStep(wear - 0.06F, wear, worn) - 0.15F * worn;
    return Colour(light, light, light * 0.97F);
  };
}

Pattern woodPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const int planks = 6 + 2 * dice.below(3);
  const float tone = dice.uniform(0.35F, 1.0F);
  const Colour base = tone * Colour(0.5F, 0.31F, 0.17F);
  return [=](float u, float v) {
    const float y = v * static_cast<float>(planks);
    const int plank = static_cast<int>(y);
    const float start = cellNoise(plank, 3, seed);
    const float x = u * 2.0F + start;
    const int piece = wrapCell(static_cast<int>(std::floor(x)), 2);
    const float shade = 0.75F + 0.5F * cellNoise(piece, plank, seed + 1U);
    const float grain = octaves(u, v, 4, 64, 4, seed + static_cast<std::uint32_t>(plank));
    const float ring = 0.5F + 0.5F * std::sin(40.0F * grain);
    Colour c = base * shade * (0.7F + 0.35F * grain + 0.2F * ring);
    const float knot = valueNoise(u, v, 9, 18, seed + 5U);
    c *= 1.0F - 0.55F * smoothStep(0.86F, 0.95F, knot);
    const float gap = std::min(toLine(y), toLine(x) * static_cast<float>(planks) / 2.0F);
    return Colour(c * (0.3F + 0.7F * smoothStep(0.01F, 0.03F, gap)));
  };
}

Pattern timberPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour base = dice.uniform(0.7F, 1.1F) * Colour(0.52F, 0.33F, 0.19F);
  return [=](float u, float v) {
    const float grain = octaves(u, v, 3, 20, 5, seed);
    const float ring = 0.5F + 0.5F * std::sin(60.0F * grain);
    const float pores = valueNoise(u, v, 12, 160, seed + 7U);
    return Colour(base * (0.62F + 0.3F * grain + 0.18F * ring + 0.16F * pores));
  };
}

}  // namespace perdure::tools::shapes

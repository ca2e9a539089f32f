#include <cmath>
#include <cstdint>
#include <vector>

#include "tools/simulate/shapes/patterns/noise.h"
#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools::shapes {
namespace {

Colour grey(float light) { return Colour::Constant(light); }

struct Patch {
  float left, bottom, right, top;
  Colour colour;
  bool holds(float u, float v) const { return u >= left && u < right && v >= bottom && v < top; }
};

Pattern patchwork(const Colour& ground, std::vector<Patch> patches) {
  return [ground, patches = std::move(patches)](float u, float v) {
    Colour c = ground;
    for (const Patch& p : patches) {
      if (p.holds(u, v)) c = p.colour;
    }
    return c;
  };
}

}  // namespace

Pattern brickPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour base(dice.uniform(0.26F, 0.42F), dice.uniform(0.11F, 0.2F),
                    dice.uniform(0.07F, 0.14F));
  const float mortar = dice.uniform(0.25F, 0.5F);
  constexpr int kRows = 16, kColumns = 5;
  return [=](float u, float v) {
    const float y = v * kRows;
    const int row = static_cast<int>(y);
    const float x = u * kColumns + (row % 2 == 1 ? 0.5F : 0.0F);
    const int column = wrapCell(static_cast<int>(std::floor(x)), kColumns);
    const float tone = 0.55F + 0.9F * cellNoise(column, row, seed);
    const float rough = 0.7F + 0.6F * octaves(u, v, 60, 60, 3, seed + 3U);
    const float joint = std::min(toLine(x) * kRows / kColumns, toLine(y));
    const float soot = 0.75F + 0.5F * octaves(u, v, 3, 3, 4, seed + 5U);
    return Colour(mix(grey(mortar), base * tone, smoothStep(0.05F, 0.1F, joint)) * rough * soot);
  };
}

Pattern plasterPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const float streaks = dice.uniform(0.1F, 0.35F);
  return [=](float u, float v) {
    float light = 0.72F + 0.22F * octaves(u, v, 5, 5, 4, seed);
    light *= 0.82F + 0.36F * octaves(u, v, 70, 70, 2, seed + 3U);
    light *= 1.0F - streaks * smoothStep(0.55F, 0.8F, octaves(u, v, 26, 3, 4, seed + 7U));
    const float crack = std::abs(octaves(u, v, 4, 4, 4, seed + 9U) - 0.5F);
    light *= 0.7F + 0.3F * smoothStep(0.001F, 0.005F, crack);
    return grey(light);
  };
}

Pattern windowsPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const float curtain = dice.uniform(0.05F, 0.4F), blind = dice.uniform(0.0F, 0.7F);
  const Colour cloth(dice.uniform(0.3F, 0.7F), dice.uniform(0.3F, 0.65F), dice.uniform(0.3F, 0.6F));
  return [=](float u, float v) {
    Colour c = grey(0.03F + 0.05F * octaves(u, v, 4, 4, 3, seed));
    if (std::min(u, 1.0F - u) < curtain * 0.5F) {
      c = cloth * (0.35F + 0.3F * std::sin(u * 119.381F) * 0.5F + 0.2F * v);
    }
    if (v > 1.0F - blind) c = cloth * (0.4F + 0.25F * toLine(v * 24.0F));
    return c;
  };
}

Pattern barkPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour base(dice.uniform(0.14F, 0.26F), dice.uniform(0.1F, 0.19F),
                    dice.uniform(0.07F, 0.14F));
  return [=](float u, float v) {
    const float furrow = std::abs(octaves(u, v, 14, 3, 5, seed) - 0.5F);
    const float light = 0.35F + 1.1F * smoothStep(0.0F, 0.12F, furrow);
    return Colour(base * light * (0.7F + 0.6F * octaves(u, v, 30, 30, 3, seed + 3U)));
  };
}

Pattern leavesPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const Colour dark(dice.uniform(0.02F, 0.06F), dice.uniform(0.07F, 0.12F), 0.02F);
  const Colour light(dice.uniform(0.14F, 0.3F), dice.uniform(0.28F, 0.42F),
                     dice.uniform(0.05F, 0.1F));
  return [=](float u, float v) {
    const float leaf = valueNoise(u, v, 40, 40, seed) * valueNoise(u, v, 23, 23, seed + 1U);
    const float clump = octaves(u, v, 6, 6, 3, seed + 5U);
    return mix(dark, light, 1.5F * leaf + 0.6F * clump - 0.15F);
  };
}

Pattern fabricPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const int style = dice.below(4), stripes = 3 + dice.below(8);
  const float depth = dice.uniform(0.25F, 0.7F);
  return [=](float u, float v) {
    const float weave = 0.9F + 0.1F * std::sin(u * 402.124F) * std::sin(v * 402.124F);
    float light = weave * (0.65F + 0.35F * octaves(u, v, 12, 12, 4, seed));
    const float n = static_cast<float>(stripes);
    if (style == 1 && toLine(v * n) < 0.2F) light *= 1.0F - depth;
    if (style == 2 && (toLine(u * n) < 0.14F) != (toLine(v * n) < 0.14F)) light *= 1.0F - depth;
    if (style == 3 &&
        cellNoise(static_cast<int>(u * 24.0F), static_cast<int>(v * 24.0F), seed) > 0.8F) {
      light *= 1.0F - depth;
    }
    return grey(light);
  };
}

Pattern metalPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  return [=](float u, float v) {
    const float brushed = valueNoise(u, v, 6, 200, seed);
    return grey(0.7F + 0.15F * brushed + 0.12F * octaves(u, v, 8, 8, 4, seed + 3U));
  };
}

Pattern carPaintPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const float dirt = dice.uniform(0.0F, 0.3F);
  return [=](float u, float v) {
    const float film = smoothStep(0.4F, 0.8F, octaves(u, v, 5, 5, 5, seed));
    return grey(0.95F - dirt * film - 0.04F * valueNoise(u, v, 200, 200, seed + 3U));
  };
}

Pattern screenPattern(Dice& dice) {
  std::vector<Patch> patches;
  const bool light = dice.chance(0.6F);
  const Colour ground = light ? grey(0.8F) : Colour(0.03F, 0.04F, 0.06F);
  const auto vivid = [&] {
    return Colour(dice.uniform(0.05F, 0.9F), dice.uniform(0.05F, 0.9F), dice.uniform(0.1F, 0.95F));
  };
  patches.push_back({0.0F, 0.93F, 1.0F, 1.0F, vivid()});
  patches.push_back({0.0F, 0.0F, dice.uniform(0.05F, 0.25F), 0.93F, vivid() * 0.6F});
  for (int i = 0; i < 4; ++i) {
    const float x = dice.uniform(0.25F, 0.7F), y = dice.uniform(0.05F, 0.6F);
    patches.push_back({x, y, x + dice.uniform(0.1F, 0.3F), y + dice.uniform(0.1F, 0.3F), vivid()});
  }
  for (int row = 0; row < 18; ++row) {
    float x = 0.28F;
    const float y = 0.05F + 0.048F * static_cast<float>(row);
    while (x < 0.9F && dice.chance(0.85F)) {
      const float end = x + dice.uniform(0.02F, 0.09F);
      patches.push_back({x, y, end, y + 0.018F, light ? grey(0.1F) : vivid()});
      x = end + 0.015F;
    }
  }
  return patchwork(ground, std::move(patches));
}

Pattern skinPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  return [=](float u, float v) {
    const float blush = octaves(u, v, 5, 5, 4, seed);
    return Colour(0.95F, 0.9F - 0.08F * blush, 0.86F - 0.1F * blush);
  };
}

Pattern booksPattern(Dice& dice) {
  std::vector<Patch> patches;
  for (float x = 0.0F; x < 0.98F;) {
    const float end = std::min(1.0F, x + dice.uniform(0.015F, 0.055F));
    const float top = dice.uniform(0.65F, 0.97F);
    const Colour c(dice.uniform(0.03F, 0.6F), dice.uniform(0.03F, 0.45F),
                   dice.uniform(0.03F, 0.4F));
    patches.push_back({x, 0.0F, end, top, c});
    const float label = dice.uniform(0.3F, 0.6F);
    patches.push_back({x + 0.003F, label, end - 0.003F, label + dice.uniform(0.05F, 0.2F),
                       mix(c, grey(0.8F), dice.uniform(0.4F, 1.0F))});
    x = end + 0.002F;
  }
  return patchwork(grey(0.02F), std::move(patches));
}

/// Strokes that resemble letters, on a sign about ten times as wide as high.
Pattern signPattern(Dice& dice) {
  std::vector<Patch> patches;
  const bool light = dice.chance(0.5F);
  const Colour ink = light ? grey(0.05F) : grey(0.95F);
  const float gap = dice.uniform(0.008F, 0.015F);
  for (float x = dice.uniform(0.08F, 0.3F); x < dice.uniform(0.7F, 0.95F);) {
    const float wide = dice.uniform(0.02F, 0.04F), stroke = 0.25F * wide;
    patches.push_back({x, 0.2F, x + stroke, 0.8F, ink});
    if (dice.chance(0.6F)) patches.push_back({x + wide - stroke, 0.2F, x + wide, 0.8F, ink});
    for (float y : {0.2F, 0.45F, 0.7F}) {
      if (dice.chance(0.55F)) patches.push_back({x, y, x + wide, y + 0.1F, ink});
    }
    x += wide + (dice.chance(0.15F) ? 4.0F : 1.0F) * gap;
  }
  return patchwork(grey(light ? 0.9F : 0.5F), std::move(patches));
}

Pattern paintingPattern(Dice& dice) {
  const std::uint32_t seed = dice.noiseSeed();
  const auto tint = [&] {
    return Colour(dice.uniform(0.05F, 0.8F), dice.uniform(0.05F, 0.7F), dice.uniform(0.05F, 0.7F));
  };
  const Colour sky = tint(), hills = tint(), field = tint(), light = tint();
  const float horizon = dice.uniform(0.3F, 0.6F), rough = dice.uniform(0.1F, 0.4F);
  return [=](float u, float v) {
    const float ridge = horizon + rough * (octaves(u, 0.5F, 3, 1, 4, seed) - 0.5F);
    const float near = 0.55F * horizon + rough * (octaves(u, 0.3F, 5, 1, 4, seed + 9U) - 0.5F);
    Colour c = mix(sky, light, octaves(u, v, 4, 6, 4, seed + 3U) * 1.4F - 0.3F);
    if (v < ridge) c = hills * (0.6F + 0.6F * octaves(u, v, 14, 8, 3, seed + 5U));
    if (v < near) c = field * (0.5F + 0.9F * octaves(u, v, 30, 12, 3, seed + 7U));
    return c;
  };
}

}  // namespace perdure::tools::shapes

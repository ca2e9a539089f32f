#include "tools/simulate/shapes/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <mutex>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools {
namespace {

using Eigen::Vector3f;

constexpr float kWidest = 1e6F;  // texels; wider footprints also give the mean
constexpr float kBlend = 1e-3F;  // distance to a level below which only that level is read

/// The patterns in the order of TextureKind.
constexpr std::array kPatterns{
    &shapes::asphaltPattern, &shapes::pavingPattern,   &shapes::grassPattern,
    &shapes::brickPattern,   &shapes::plasterPattern,  &shapes::windowsPattern,
    &shapes::barkPattern,    &shapes::leavesPattern,   &shapes::woodPattern,
    &shapes::fabricPattern,  &shapes::metalPattern,    &shapes::carPaintPattern,
    &shapes::screenPattern,  &shapes::skinPattern,     &shapes::markingsPattern,
    &shapes::tilesPattern,   &shapes::earthPattern,    &shapes::booksPattern,
    &shapes::timberPattern,  &shapes::paintingPattern, &shapes::signPattern,
};

/// Texels of a tileable square of size × size, row by row.
std::vector<Vector3f> paintPattern(TextureKind kind, std::uint64_t seed, int size) {
  shapes::Dice dice(seed ^ (static_cast<std::uint64_t>(kind) << 40U));
  const shapes::Pattern pattern = kPatterns.at(static_cast<std::size_t>(kind))(dice);
  std::vector<Vector3f> texels;
  texels.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const float step = 1.0F / static_cast<float>(size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Vector3f colour =
          pattern((static_cast<float>(x) + 0.5F) * step, (static_cast<float>(y) + 0.5F) * step);
      texels.push_back(colour.cwiseMax(0.0F).cwiseMin(1.0F));
    }
  }
  return texels;
}

const std::array<float, 256>& decoding() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const float root = static_cast<float>(i) / 255.0F;
      t[i] = root * root;
    }
    return t;
  }();
  return table;
}

/// Wraps x to [0, 1); |x| must be below 2³¹.
float wrapped(float x) {
  const float part = x - static_cast<float>(static_cast<int>(x));
  return part < 0.0F ? part + 1.0F : part;
}

/// The level log2(footprint), and the weight of the next one, linear between powers of two.
std::pair<std::size_t, float> levelOf(float texels, std::size_t last) {
  const auto bits = std::bit_cast<std::uint32_t>(texels);
  const std::size_t level = (bits >> 23U) - 127U;
  if (level >= last) return {last, 0.0F};
  return {level, static_cast<float>(bits & 0x7FFFFFU) * 0x1.0p-23F};
}

std::uint8_t encode(float linear) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::sqrt(std::clamp(linear, 0.0F, 1.0F))));
}

std::vector<Vector3f> halved(const std::vector<Vector3f>& texels, int size) {
  const int half = size / 2;
  std::vector<Vector3f> out(static_cast<std::size_t>(half) * static_cast<std::size_t>(half));
  const auto at = [&](int x, int y) {
    return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) +
                  static_cast<std::size_t>(x)];
  };
  std::size_t i = 0;
  for (int y = 0; y < size; y += 2) {
    for (int x = 0; x < size; x += 2) {
      out[i++] = (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0F;
    }
  }
  return out;
}

}  // namespace

Texture::Texture(TextureKind kind, std::uint64_t seed, int size) {
  if (size < 1 || size > 4096 || (size & (size - 1)) != 0) {
    throw std::invalid_argument("a texture's size is a power of two from 1 to 4096");
  }
  std::vector<Vector3f> texels = paintPattern(kind, seed, size);
  for (;; size /= 2) {
    Level level{size, {}};
    level.texels.reserve(texels.size());
    for (const Vector3f& c : texels) {
      level.texels.push_back({encode(c.x()), encode(c.y()), encode(c.z()), 255});
    }
    levels_.push_back(std::move(level));
    if (size == 1) return;
    texels = halved(texels, size);
  }
}

Vector3f Texture::bilinear(const Level& level, float u, float v) {
  const float scale = static_cast<float>(level.size);
  const float x = u * scale - 0.5F, y = v * scale - 0.5F;
  // x and y are at least −1: truncation after adding one equals floor, and is much faster.
  const int ix = static_cast<int>(x + 1.0F) - 1, iy = static_cast<int>(y + 1.0F) - 1;
  const float ax = x - static_cast<float>(ix), ay = y - static_cast<float>(iy);
  const int mask = level.size - 1;
  const auto& table = decoding();
  const auto at = [&](int column, int row) {
    const Texel& t =
        level.texels[static_cast<std::size_t>(row & mask) * static_cast<std::size_t>(level.size) +
                     static_cast<std::size_t>(column & mask)];
    return Vector3f(table[t[0]], table[t[1]], table[t[2]]);
  };
  const Vector3f low = (1.0F - ax) * at(ix, iy) + ax * at(ix + 1, iy);
  const Vector3f high = (1.0F - ax) * at(ix, iy + 1) + ax * at(ix + 1, iy + 1);
  return (1.0F - ay) * low + ay * high;
}

Vector3f Texture::sample(const Eigen::Vector2f& uv, float footprint) const {
  const float texels =
      std::clamp(footprint * static_cast<float>(levels_.front().size), 1.0F, kWidest);
  const auto [level, between] = levelOf(texels, levels_.size() - 1);
  const float u = wrapped(uv.x()), v = wrapped(uv.y());
  const Vector3f fine = bilinear(levels_[level], u, v);
  if (between < kBlend) return fine;
  return fine + between * (bilinear(levels_[level + 1], u, v) - fine);
}

std::shared_ptr<const Texture> makeTexture(TextureKind kind, std::uint64_t seed, int size) {
  using Key = std::tuple<TextureKind, std::uint64_t, int>;
  static std::mutex mutex;
  static std::map<Key, std::weak_ptr<const Texture>> known;
  const std::scoped_lock lock(mutex);
  auto& slot = known[Key(kind, seed, size)];
  if (auto texture = slot.lock()) return texture;
  auto texture = std::make_shared<const Texture>(kind, seed, size);
  slot = texture;
  return texture;
}

}  // namespace perdure::tools

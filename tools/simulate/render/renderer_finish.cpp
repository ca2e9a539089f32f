// Implements antialiasing and motion blur of Renderer.
#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/simulate/render/renderer.h"

namespace perdure::tools {
namespace {

constexpr float kMinSmear = 0.6F;   ///< pixels; less is invisible
constexpr float kLongSmear = 3.0F;  ///< pixels; above it, taps at integer pixels suffice
constexpr int kMaxTaps = 16;
constexpr unsigned kLeft = 1, kRight = 2, kAbove = 4, kBelow = 8;

struct Ray {
  float dx, dy, share;
};
/// Additional rays of a pixel, and the weight of the central ray.
struct Pattern {
  float centre_share;
  unsigned count;
  std::array<Ray, 4> rays;
};

/// Chooses the additional rays by the neighbours that differ. One neighbour, or two at a corner:
/// two rays in that half of the pixel. Three or more (foliage without clear edges): two rays. Two
/// opposite neighbours (thin objects): four rays.
Pattern makePattern(unsigned edges) {
  constexpr float kNear = 0.2F, kFar = 0.22F, kCentre = 1.0F - kNear - kFar;
  const float x = static_cast<float>((edges >> 1 & 1U)) - static_cast<float>(edges & 1U);
  const float y = static_cast<float>((edges >> 3 & 1U)) - static_cast<float>(edges >> 2 & 1U);
  if (std::popcount(edges) >= 3) {
    return {0.34F, 2, {{{-0.3F, -0.2F, 0.33F}, {0.3F, 0.2F, 0.33F}}}};
  }
  if (x != 0.0F && y != 0.0F) {
    return {kCentre, 2, {{{0.13F * x, 0.35F * y, kNear}, {0.37F * x, 0.17F * y, kFar}}}};
  }
  if (x != 0.0F || y != 0.0F) {
    return {kCentre,
            2,
            {{{0.18F * x - 0.22F * y, 0.18F * y + 0.22F * x, kNear},
              {0.4F * x + 0.22F * y, 0.4F * y - 0.22F * x, kFar}}}};
  }
  constexpr float kEven = 0.2F;
  return {kEven,
          4,
          {{{-0.375F, -0.125F, kEven},
            {0.125F, -0.375F, kEven},
            {0.375F, 0.125F, kEven},
            {-0.125F, 0.375F, kEven}}}};
}

const Pattern& patternOf(unsigned edges) {
  static const std::array<Pattern, 16> patterns = [] {
    std::array<Pattern, 16> all{};
    for (unsigned i = 0; i < all.size(); ++i) all[i] = makePattern(i);
    return all;
  }();
  return patterns[edges];
}

const Eigen::Vector4f& nearest(const Picture& picture, float x, float y) {
  const int column = std::clamp(static_cast<int>(x + 0.5F), 0, picture.width - 1);
  const int row = std::clamp(static_cast<int>(y + 0.5F), 0, picture.height - 1);
  return picture.radiance[picture.index(column, row)];
}

/// Bilinear interpolation at (x, y); constant beyond the border.
Eigen::Vector4f between(const Picture& picture, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(picture.width - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(picture.height - 1));
  const int left = std::min(static_cast<int>(x), picture.width - 2);
  const int top = std::min(static_cast<int>(y), picture.height - 2);
  const float u = x - static_cast<float>(left), v = y - static_cast<float>(top);
  const Eigen::Vector4f* upper = &picture.radiance[picture.index(left, top)];
  const Eigen::Vector4f* lower = upper + picture.width;
  return (1.0F - v) * ((1.0F - u) * upper[0] + u * upper[1]) +
         v * ((1.0F - u) * lower[0] + u * lower[1]);
}

}  // namespace

unsigned Renderer::edgesOf(const Picture& picture, int column, int row) const {
  const Detail& here = details_[picture.index(column, row)];
  const auto differs = [&](const Detail& there) {
    return there.key != here.key || (here.key != 0 && there.normal.dot(here.normal) < 0.6F);
  };
  const auto bends = [&](const Detail& before, const Detail& after) {
    const float bend = before.inverse_distance + after.inverse_distance - 2 * here.inverse_distance;
    return std::abs(bend) > 0.06F * here.inverse_distance;
  };
  const int left = std::max(column - 1, 0), right = std::min(column + 1, picture.width - 1);
  const int above = std::max(row - 1, 0), below = std::min(row + 1, picture.height - 1);
  const Detail &l = details_[picture.index(left, row)], &r = details_[picture.index(right, row)];
  const Detail &a = details_[picture.index(column, above)],
               &b = details_[picture.index(column, below)];
  const unsigned edges = (differs(l) ? kLeft : 0U) | (differs(r) ? kRight : 0U) |
                         (differs(a) ? kAbove : 0U) | (differs(b) ? kBelow : 0U);
  if (edges != 0 || here.key == 0) return edges;
  if (left < column && column < right && bends(l, r)) return kLeft | kRight;
  return above < row && row < below && bends(a, b) ? kAbove | kBelow : 0U;
}

void Renderer::smoothTile(int left, int top, Picture& picture) {
  Samples samples;
  for (int row = top; row < std::min(top + kTile, picture.height); ++row) {
    for (int column = left; column < std::min(left + kTile, picture.width); ++column) {
      if (!lens_->sees(column, row)) continue;
      const unsigned edges = edgesOf(picture, column, row);
      if (edges == 0) continue;
      const Pattern& pattern = patternOf(edges);
      picture.radiance[picture.index(column, row)] *= pattern.centre_share;
      for (unsigned i = 0; i < pattern.count; ++i) {
        const auto& [dx, dy, share] = pattern.rays[i];
        samples.places[samples.packet.count] = {column, row};
        samples.shares[samples.packet.count] = share;
        aim(samples.packet, column, row, dx, dy);
        if (samples.packet.count == kPacket) addSamples(samples, picture);
      }
    }
  }
  addSamples(samples, picture);
}

void Renderer::addSamples(Samples& samples, Picture& picture) const {
  Packet& packet = samples.packet;
  if (packet.count == 0) return;
  follow(packet);
  findSun(packet);
  for (unsigned i = 0; i < packet.count; ++i) {
    const Place& place = samples.places[i];
    picture.radiance[picture.index(place.column, place.row)].head<3>() +=
        samples.shares[i] * lighting_.shade(packet.origins[i], packet.directions[i], packet.hits[i],
                                            packet.in_sun[i], lens_->pixelAngle());
  }
  packet.count = 0;
}

/// Motion of a pixel's content during the exposure, in pixels.
Eigen::Vector2f Renderer::smear(const Picture& picture, int column, int row) const {
  const Eigen::Vector3f& d = lens_->direction(column, row);
  const std::size_t at = picture.index(column, row);
  Eigen::Vector3f rate = d.cross(turn_rate_C_);
  if (picture.instance[at] != kNothing) {
    const Instance& instance = world_.instances()[picture.instance[at]];
    const float inverse = details_[at].inverse_distance;
    rate -= inverse * eye_velocity_C_;
    if (instance.moves) {
      const Eigen::Vector3f where = eyes_.front().p + R_CW_.transpose() * d / inverse;
      rate +=
          inverse * (R_CW_ * (instance.velocity + instance.turn_rate.cross(where - instance.p)));
    }
  }
  const float scale = exposure_s_ / (d.z() * lens_->pixelAngle());
  return scale * (rate.head<2>() - rate.z() / d.z() * d.head<2>());
}

void Renderer::blurRow(int row, const Picture& picture) {
  for (int column = 0; column < picture.width; ++column) {
    const std::size_t at = picture.index(column, row);
    blurred_[at] = picture.radiance[at];
    if (!lens_->sees(column, row)) continue;
    const Eigen::Vector2f whole = smear(picture, column, row);
    const float length = whole.norm();
    if (length < kMinSmear) continue;
    const int taps = std::clamp(static_cast<int>(length + 0.5F), 2, kMaxTaps);
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (int i = 0; i < taps; ++i) {
      const float share = (static_cast<float>(i) + 0.5F) / static_cast<float>(taps) - 0.5F;
      const float x = static_cast<float>(column) + share * whole.x();
      const float y = static_cast<float>(row) + share * whole.y();
      sum += length > kLongSmear ? nearest(picture, x, y) : between(picture, x, y);
    }
    blurred_[at] = sum / static_cast<float>(taps);
  }
}

}  // namespace perdure::tools

// The second half of Renderer: smooth edges and motion blur.
#include <algorithm>
#include <bit>
#include <cmath>

#include "tools/simulate/renderer.h"

namespace perdure::tools {
namespace {

constexpr int kTile = 32;
constexpr float kMinSmear = 0.6F;  ///< pixels; less is not to be seen
constexpr int kMaxTaps = 12;
constexpr unsigned kLeft = 1, kRight = 2, kAbove = 4, kBelow = 8;

struct Ray {
  float dx, dy, share;
};
/// More rays of a pixel, and what is left of the one through its centre.
struct Pattern {
  float centre_share;
  unsigned count;
  std::array<Ray, 4> rays;
};

/// An edge towards one neighbour lies in that half of the pixel: two rays there. Foliage, where all
/// neighbours differ, has no edge to be drawn smoothly: two rays. Otherwise four.
const Pattern& patternOf(unsigned edges) {
  static constexpr std::array<Pattern, 4> kTowards = {
      {{0.58F, 2, {{{-0.18F, 0.22F, 0.2F}, {-0.4F, -0.22F, 0.22F}}}},
       {0.58F, 2, {{{0.18F, -0.22F, 0.2F}, {0.4F, 0.22F, 0.22F}}}},
       {0.58F, 2, {{{-0.22F, -0.18F, 0.2F}, {0.22F, -0.4F, 0.22F}}}},
       {0.58F, 2, {{{0.22F, 0.18F, 0.2F}, {-0.22F, 0.4F, 0.22F}}}}}};
  static constexpr Pattern kAround = {0.2F,
                                      4,
                                      {{{-0.375F, -0.125F, 0.2F},
                                        {0.125F, -0.375F, 0.2F},
                                        {0.375F, 0.125F, 0.2F},
                                        {-0.125F, 0.375F, 0.2F}}}};
  static constexpr Pattern kFoliage = {0.34F, 2, {{{-0.3F, -0.2F, 0.33F}, {0.3F, 0.2F, 0.33F}}}};
  const int count = std::popcount(edges);
  if (count == 1) return kTowards[static_cast<std::size_t>(std::countr_zero(edges))];
  return count >= 3 ? kFoliage : kAround;
}

/// Between pixels; held at the border.
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

/// How far what a pixel shows moves in the image during the exposure, in pixels.
Eigen::Vector2f Renderer::smear(const Picture& picture, int column, int row) const {
  const Eigen::Vector3f& d = lens_->direction(column, row);
  const std::size_t at = picture.index(column, row);
  Eigen::Vector3f rate = d.cross(turn_rate_C_);
  if (picture.instance[at] != kNothing) {
    const Instance& instance = world_.instances()[picture.instance[at]];
    Eigen::Vector3f velocity = instance.velocity - eye_velocity_W_;
    const float inverse = details_[at].inverse_distance;
    if (!instance.turn_rate.isZero()) {
      const Eigen::Vector3f where = eyes_.front().p + R_CW_.transpose() * d / inverse;
      velocity += instance.turn_rate.cross(where - instance.p);
    }
    rate += inverse * (R_CW_ * velocity);
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
    const int taps = std::min(2 + static_cast<int>(0.7F * length), kMaxTaps);
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (int i = 0; i < taps; ++i) {
      const float share = (static_cast<float>(i) + 0.5F) / static_cast<float>(taps) - 0.5F;
      sum += between(picture, static_cast<float>(column) + share * whole.x(),
                     static_cast<float>(row) + share * whole.y());
    }
    blurred_[at] = sum / static_cast<float>(taps);
  }
}

}  // namespace perdure::tools

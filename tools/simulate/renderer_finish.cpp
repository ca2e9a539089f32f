// The second half of Renderer: smooth edges and motion blur.
#include <algorithm>
#include <cmath>

#include "tools/simulate/renderer.h"

namespace perdure::tools {
namespace {

constexpr int kTile = 32;
constexpr float kMinSmear = 0.6F;  ///< pixels; less is not to be seen
constexpr int kMaxTaps = 12;
constexpr std::array<std::array<float, 2>, 4> kOffsets = {
    {{-0.375F, -0.125F}, {0.125F, -0.375F}, {0.375F, 0.125F}, {-0.125F, 0.375F}}};

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

bool Renderer::isEdge(const Picture& picture, int column, int row) const {
  const Detail& here = details_[picture.index(column, row)];
  const auto differs = [&](const Detail& there) {
    return there.key != here.key || (here.key != 0 && there.normal.dot(here.normal) < 0.85F);
  };
  const auto bends = [&](const Detail& before, const Detail& after) {
    const float bend = before.inverse_distance + after.inverse_distance - 2 * here.inverse_distance;
    return std::abs(bend) > 0.03F * here.inverse_distance;
  };
  const int left = std::max(column - 1, 0), right = std::min(column + 1, picture.width - 1);
  const int above = std::max(row - 1, 0), below = std::min(row + 1, picture.height - 1);
  const Detail &l = details_[picture.index(left, row)], &r = details_[picture.index(right, row)];
  const Detail &a = details_[picture.index(column, above)],
               &b = details_[picture.index(column, below)];
  if (differs(l) || differs(r) || differs(a) || differs(b)) return true;
  return here.key != 0 && left < column && column < right && above < row && row < below &&
         (bends(l, r) || bends(a, b));
}

void Renderer::smoothTile(int left, int top, Picture& picture) {
  std::array<Place, kPacket / kOffsets.size()> places;
  unsigned count = 0;
  for (int row = top; row < std::min(top + kTile, picture.height); ++row) {
    for (int column = left; column < std::min(left + kTile, picture.width); ++column) {
      if (!lens_->sees(column, row) || !isEdge(picture, column, row)) continue;
      places[count++] = {column, row};
      if (count == places.size()) {
        smoothPixels(places.data(), count, picture);
        count = 0;
      }
    }
  }
  if (count > 0) smoothPixels(places.data(), count, picture);
}

void Renderer::smoothPixels(const Place* places, unsigned count, Picture& picture) {
  Packet packet;
  for (unsigned i = 0; i < count; ++i) {
    for (const auto& [dx, dy] : kOffsets) aim(packet, places[i].column, places[i].row, dx, dy);
  }
  follow(packet);
  findSun(packet);
  constexpr float kShare = 1.0F / (kOffsets.size() + 1);
  for (unsigned i = 0; i < packet.count; ++i) {
    const Place& place = places[i / kOffsets.size()];
    Eigen::Vector4f& sum = picture.radiance[picture.index(place.column, place.row)];
    if (i % kOffsets.size() == 0) sum *= kShare;
    // A bright spot of the sun in one of the rays would stand out as a single white pixel.
    sum.head<3>() += kShare * lighting_
                                  .shade(packet.origins[i], packet.directions[i], packet.hits[i],
                                         packet.in_sun[i], lens_->pixelAngle())
                                  .cwiseMin(8.0F);
  }
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

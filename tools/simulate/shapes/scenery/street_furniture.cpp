#include <algorithm>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

void addLamp(MeshBuilder& b, const Vec3& s, int metal, int light) {
  const float r = 0.012F * s.z(), x = 0.5F * s.x();
  b.tube({-x, 0.0F, 0.0F}, {-x, 0.0F, 0.18F * s.z()}, 1.7F * r, 1.6F * r, 10, metal);
  b.pipe({{-x, 0.0F, 0.1F},
          {-x, 0.0F, 0.6F * s.z()},
          {-x, 0.0F, 0.95F * s.z()},
          {-0.6F * x, 0.0F, s.z()},
          {0.5F * x, 0.0F, s.z()}},
         {r, 0.8F * r, 0.6F * r, 0.5F * r, 0.5F * r}, 8, metal);
  b.box({0.2F * x, -0.09F, s.z() - 0.1F}, {x, 0.09F, s.z() + 0.04F}, metal);
  b.box({0.3F * x, -0.07F, s.z() - 0.12F}, {0.95F * x, 0.07F, s.z() - 0.1F}, light);
}

void addSign(MeshBuilder& b, const Vec3& s, int metal, Dice& dice) {
  const float r = 0.03F, y = 0.5F * s.y(), wide = std::max(y, 0.05F);
  b.tube({0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, s.z()}, r, r, 8, metal);
  static const std::array<Vec3, 3> kFields{
      {{0.02F, 0.1F, 0.5F}, {0.6F, 0.03F, 0.03F}, {0.8F, 0.7F, 0.1F}}};
  const int field = b.material(plain(dice.pick(kFields), 0.3F));
  const int white = b.material(plain({0.82F, 0.82F, 0.8F}, 0.3F));
  const Vec3 centre(0.04F, 0.0F, s.z() - wide);
  b.tube(centre - Vec3(0.01F, 0.0F, 0.0F), centre, wide, wide, 20, metal);
  b.tube(centre - Vec3(0.005F, 0.0F, 0.0F), centre + Vec3(0.004F, 0.0F, 0.0F), 0.97F * wide,
         0.97F * wide, 20, field);
  b.box(centre + Vec3(0.0F, -0.55F * wide, -0.14F * wide),
        centre + Vec3(0.008F, 0.55F * wide, 0.14F * wide), white);
}

void addBollard(MeshBuilder& b, const Vec3& s, int metal, Dice& dice) {
  const int band = b.material(plain(paintColour(dice), 0.3F));
  const float r = 0.5F * std::min(s.x(), s.y());
  b.tube({0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.08F * s.z()}, r, r, 12, metal);
  b.pipe({{0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.96F * s.z()}, {0.0F, 0.0F, s.z()}},
         {0.72F * r, 0.6F * r, 0.3F * r}, 12, metal);
  for (float z : {0.3F, 0.55F, 0.8F}) {
    b.tube({0.0F, 0.0F, z * s.z()}, {0.0F, 0.0F, (z + 0.06F) * s.z()}, 0.74F * r, 0.74F * r, 12,
           band);
  }
}

/// Adds a post with a lantern that is not wider than its foot.
void addPost(MeshBuilder& b, const Vec3& s, int metal, int light, Dice& dice) {
  const float r = 0.5F * std::min(s.x(), s.y());
  const auto up = [](float z) { return Vec3(0.0F, 0.0F, z); };
  b.pipe({up(0.0F), up(0.5F), up(0.9F), up(1.0F)}, {r, r, 0.92F * r, 0.6F * r}, 12, metal);
  b.box({-0.35F * r, -1.0F * r, 0.35F}, {0.35F * r, -0.9F * r, 0.75F}, metal);
  const float head = dice.uniform(0.35F, 0.55F);
  b.tube(up(0.95F), up(s.z() - head), 0.56F * r, 0.42F * r, 10, metal);
  b.tube(up(s.z() - head), up(s.z() - 0.12F), 0.5F * r, 0.9F * r, 10, light);
  b.tube(up(s.z() - 0.12F), up(s.z()), r, 0.25F * r, 10, metal);
  const int notice = b.material(plain(paintColour(dice), 0.2F));
  const float z = dice.uniform(1.3F, 2.0F);
  if (dice.chance(0.5F))
    b.tube(up(z), up(z + dice.uniform(0.2F, 0.4F)), 0.6F * r, 0.6F * r, 10, notice);
  for (float ring : {1.1F, 2.6F})
    b.tube(up(ring), up(ring + 0.05F), 0.64F * r, 0.64F * r, 10, metal);
}

}  // namespace

Mesh makePole(const Order& order) {
  Dice dice(order.look_seed ^ 0x901EULL);
  MeshBuilder b;
  const Vec3 s = order.size.cast<float>();
  const float tone = dice.uniform(0.08F, 0.4F);
  const auto sheet = sharedTexture(TextureKind::kMetal, order.look_seed, dice, 128);
  const int metal = b.material(textured({tone, 1.03F * tone, 1.02F * tone}, sheet, 0.3F), 0.5F);
  if (s.x() > 0.7F) {
    addLamp(b, s, metal, b.material(plain({0.9F, 0.88F, 0.8F}, 0.3F)));
  } else if (s.z() > 1.5F && s.y() > 0.25F) {
    addSign(b, s, metal, dice);
  } else if (s.z() > 3.0F) {
    addPost(b, s, metal, b.material(plain({0.9F, 0.88F, 0.8F}, 0.3F)), dice);
  } else {
    addBollard(b, s, metal, dice);
  }
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes

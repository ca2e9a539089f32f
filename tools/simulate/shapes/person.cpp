#include <algorithm>
#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

constexpr float kStature = 1.75F;  // metres; the dimensions below belong to this body height

struct Clothes {
  int skin, hair, shirt, trousers, shoes;
  bool short_sleeves, short_legs;
};

struct Pose {
  float stride = 0.0F;  ///< angle of the front leg from the vertical
  float spread = 0.1F;  ///< sideways angle of the arms
  float left_first = 1.0F;
};

Ring ellipse(const Vec3& centre, float rx, float ry, int sides) {
  Ring ring = circle(Vec3::Zero(), Vec3::UnitZ(), 1.0F, sides);
  for (Vec3& p : ring) p = centre + Vec3(p.x() * rx, p.y() * ry, 0.0F);
  return ring;
}

void addTorso(MeshBuilder& b, const Clothes& c, float belly) {
  struct Level {
    float z, x, rx, ry;
  };
  const std::array<Level, 9> levels{{{0.84F, 0.0F, 0.05F, 0.1F},
                                     {0.9F, -0.01F, 0.105F, 0.165F},
                                     {0.99F, -0.005F, 0.11F, 0.165F},
                                     {1.1F, 0.005F + belly / 3.0F, 0.095F + belly, 0.145F + belly},
                                     {1.22F, 0.005F, 0.11F + belly / 2.0F, 0.16F},
                                     {1.34F, 0.0F, 0.115F, 0.18F},
                                     {1.42F, -0.005F, 0.095F, 0.175F},
                                     {1.465F, -0.01F, 0.06F, 0.1F},
                                     {1.49F, -0.01F, 0.05F, 0.055F}}};
  std::vector<Ring> rings;
  for (const Level& l : levels) rings.push_back(ellipse({l.x, 0.0F, l.z}, l.rx, l.ry, 12));
  b.loft(
      rings, [&](std::size_t i, std::size_t) { return i < 2 ? c.trousers : c.shirt; }, c.trousers,
      c.shirt, 70.0F);
}

void addHead(MeshBuilder& b, const Clothes& c, bool long_hair) {
  b.tube({-0.01F, 0.0F, 1.46F}, {0.0F, 0.0F, 1.56F}, 0.052F, 0.05F, 8, c.skin);
  b.ellipsoid({0.012F, 0.0F, 1.625F}, {0.092F, 0.073F, 0.118F}, 10, 7, c.skin);
  b.ellipsoid({0.105F, 0.0F, 1.61F}, {0.018F, 0.014F, 0.024F}, 5, 4, c.skin);
  b.ellipsoid({-0.014F, 0.0F, 1.668F}, {0.098F, 0.083F, 0.092F}, 10, 6, c.hair);
  if (long_hair) b.ellipsoid({-0.055F, 0.0F, 1.57F}, {0.055F, 0.085F, 0.15F}, 8, 5, c.hair);
}

void addLeg(MeshBuilder& b, const Clothes& c, float side, float angle, float bend) {
  const Vec3 hip(0.0F, side * 0.088F, 0.92F);
  const auto down = [](float a) { return Vec3(std::sin(a), 0.0F, -std::cos(a)); };
  const Vec3 knee = hip + 0.43F * down(angle);
  const Vec3 calf = knee + 0.13F * down(angle - bend) - Vec3(0.012F, 0.0F, 0.0F);
  const Vec3 ankle = knee + 0.42F * down(angle - bend);
  const Vec3 top = hip + Vec3(0.0F, -0.035F * side, 0.05F);
  b.pipe({top, hip - Vec3(0.0F, 0.008F * side, 0.0F), hip + 0.2F * down(angle), knee},
         {0.05F, 0.085F, 0.08F, 0.057F}, 9, c.trousers);
  b.pipe({knee - 0.03F * down(angle), calf, ankle}, {0.055F, 0.056F, 0.036F}, 8,
         c.short_legs ? c.skin : c.trousers);
  const float heel = std::clamp(angle - bend, -0.9F, 0.35F);
  b.placing =
      Eigen::Affine3f(Eigen::Translation3f(ankle)) * Eigen::AngleAxisf(-heel, Vec3::UnitY());
  b.ellipsoid({0.055F, 0.0F, -0.04F}, {0.128F, 0.046F, 0.052F}, 8, 5, c.shoes);
  b.placing.setIdentity();
}

void addArm(MeshBuilder& b, const Clothes& c, float side, float swing, float spread) {
  const Vec3 shoulder(-0.005F, side * 0.178F, 1.4F);
  const auto down = [&](float a, float out) {
    return Vec3(Vec3(std::sin(a), side * std::sin(out), -std::cos(a) * std::cos(out)).normalized());
  };
  const Vec3 elbow = shoulder + 0.3F * down(swing, spread);
  const Vec3 wrist =
      elbow + 0.25F * down(swing + 0.25F + 0.5F * std::max(swing, 0.0F), 0.6F * spread);
  const Vec3 top = shoulder + Vec3(0.0F, -0.03F * side, 0.045F);
  b.pipe({top, shoulder, shoulder + 0.14F * down(swing, spread), elbow},
         {0.02F, 0.06F, 0.05F, 0.042F}, 8, c.shirt);
  b.pipe({elbow + 0.02F * Vec3::UnitZ(), wrist}, {0.041F, 0.029F}, 8,
         c.short_sleeves ? c.skin : c.shirt);
  b.ellipsoid(wrist + 0.055F * (wrist - elbow).normalized(), {0.032F, 0.026F, 0.068F}, 6, 5,
              c.skin);
}

Clothes dress(MeshBuilder& b, const Order& order, Dice& dice) {
  const auto cloth = [&] {
    return sharedTexture(TextureKind::kFabric, order.look_seed, dice, 128);
  };
  const auto skin_texture = sharedTexture(TextureKind::kSkin, order.look_seed, dice, 64);
  static const std::array<Vec3, 6> kHairs{{{0.015F, 0.01F, 0.008F},
                                           {0.06F, 0.03F, 0.015F},
                                           {0.2F, 0.11F, 0.05F},
                                           {0.42F, 0.3F, 0.13F},
                                           {0.3F, 0.29F, 0.28F},
                                           {0.18F, 0.05F, 0.02F}}};
  Clothes c{};
  c.skin = b.material(textured(skinColour(dice), skin_texture, 0.05F), 0.4F);
  c.hair = b.material(plain(dice.pick(kHairs), 0.15F));
  c.shirt = b.material(
      dice.chance(0.3F) ? plain(clothColour(dice)) : textured(clothColour(dice), cloth()), 0.7F);
  c.trousers = b.material(
      dice.chance(0.7F) ? plain(clothColour(dice)) : textured(clothColour(dice), cloth()), 0.4F);
  c.shoes = b.material(plain(clothColour(dice) * 0.6F, 0.15F));
  c.short_sleeves = dice.chance(0.4F);
  c.short_legs = dice.chance(0.2F);
  return c;
}

/// The pose of which the proportions are nearest to those of the size.
Pose poseFor(const Order& order, const std::string& shape, Dice& dice) {
  const auto tall = static_cast<float>(order.size.z());
  const float length = static_cast<float>(order.size.x()) / tall * kStature;
  const float width = static_cast<float>(order.size.y()) / tall * kStature;
  Pose pose;
  const float reach = std::clamp((length - 0.27F) / 1.7F, 0.02F, 0.5F);
  pose.stride = shape == "standing" ? dice.uniform(0.0F, 0.06F) : std::asin(reach);
  pose.spread = std::asin(std::clamp((width - 0.46F) / 0.85F, 0.04F, 0.5F));
  pose.left_first = dice.chance(0.5F) ? 1.0F : -1.0F;
  return pose;
}

void addBackpack(MeshBuilder& b, Dice& dice) {
  const int bag = b.material(plain(clothColour(dice), 0.05F));
  b.ellipsoid({-0.17F, 0.0F, 1.2F}, {0.1F, 0.14F, 0.21F}, 8, 6, bag);
}

}  // namespace

Mesh makePerson(const Order& order) {
  Dice dice(order.look_seed ^ 0x9E5ULL);
  const std::string shape = chosenShape(order, "person", {"standing", "walking"});
  MeshBuilder b;
  const Clothes clothes = dress(b, order, dice);
  const Pose pose = poseFor(order, shape, dice);
  addTorso(b, clothes, dice.uniform(0.0F, 0.04F));
  addHead(b, clothes, dice.chance(0.4F));
  for (float side : {1.0F, -1.0F}) {
    const float leg = side * pose.left_first * pose.stride;
    addLeg(b, clothes, side, leg, leg < 0.0F ? 0.9F * pose.stride : 0.15F * pose.stride);
    addArm(b, clothes, side, -0.9F * leg, pose.spread);
  }
  if (dice.chance(0.2F)) addBackpack(b, dice);
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes

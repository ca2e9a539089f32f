#include "tools/simulate/shapes/vehicles/vehicle_parts.h"

#include <array>
#include <cmath>

#include "tools/simulate/shapes/looks.h"

namespace perdure::tools::shapes {
namespace {

constexpr float kBodyShare = 0.955F;  // share of the width without the mirrors

void addMirrors(MeshBuilder& b, const BodyProfile& p, const Vec3& size, float full_width,
                int material) {
  const float x = (0.5F - p.windscreen.from - 0.06F) * size.x();
  const float z = (lineAt(p.belt, p.windscreen.from + 0.05F) + 0.06F) * size.z();
  const float reach = full_width / 2.0F - 0.45F * size.y();
  for (float side : {1.0F, -1.0F}) {
    const Vec3 centre(x, side * (full_width / 2.0F - reach / 2.0F), z);
    b.ellipsoid(centre, {0.018F * size.x(), reach / 2.0F, 0.045F * size.z()}, 6, 4, material);
  }
}

void addHandles(MeshBuilder& b, const BodyProfile& p, const Vec3& size, int material) {
  for (std::size_t i = 1; i < p.seams.size(); ++i) {
    const float x = (0.5F - p.seams[i] + 0.03F) * size.x();
    const float z = (lineAt(p.belt, p.seams[i]) - 0.05F) * size.z();
    for (float side : {1.0F, -1.0F}) {
      const float y = side * 0.495F * size.y();
      const float half = 0.012F * size.y();
      b.box({x - 0.02F * size.x(), y - half, z - 0.009F * size.z()},
            {x + 0.02F * size.x(), y + half, z + 0.009F * size.z()}, material);
    }
  }
}

void addRails(MeshBuilder& b, const BodyProfile& p, const Vec3& size, int material) {
  const float y = 0.42F * p.roof_width * size.y();
  for (float side : {1.0F, -1.0F}) {
    const auto at = [&](float x, float lift) {
      return Vec3((0.5F - x) * size.x(), side * y, (lineAt(p.top, x) - 0.02F + lift) * size.z());
    };
    const float r = 0.01F * size.z();
    b.pipe({at(0.46F, 0.0F), at(0.5F, 0.035F), at(0.82F, 0.035F), at(0.87F, 0.0F)}, {r, r, r, r}, 4,
           material);
  }
}

struct WheelLook {
  int rubber = 0, rim = 0, dark = 0;  ///< indices of materials
  int spokes = 5;                     ///< 0: a closed disc
  float rim_share = 0.66F;            ///< share of the radius
};

constexpr int kSides = 12;

void addSpokes(MeshBuilder& b, const Vec3& hub, float reach, float half_width, int count,
               int material) {
  b.begin(10.0F);
  for (int i = 0; i < count; ++i) {
    const float a = 2.0F * kPi * static_cast<float>(i) / static_cast<float>(count) + 0.3F;
    const Vec3 along(std::cos(a), 0.0F, std::sin(a)), side(-std::sin(a), 0.0F, std::cos(a));
    const Vec3 inner = hub + 0.1F * reach * along, outer = hub + reach * along;
    b.quad(outer + 0.8F * half_width * side, outer - 0.8F * half_width * side,
           inner - half_width * side, inner + half_width * side, material);
  }
}

/// Adds a wheel whose axle points to +y (outside), before the builder's transform.
void addWheel(MeshBuilder& b, const Vec3& centre, float radius, float width,
              const WheelLook& look) {
  const float rim = look.rim_share;
  const std::array<Vec2, 6> profile{{{-0.5F, 0.9F},
                                     {-0.38F, 1.0F},
                                     {0.38F, 1.0F},
                                     {0.5F, 0.92F},
                                     {0.5F, rim},
                                     {0.28F, rim - 0.05F}}};
  std::vector<Ring> rings;
  for (const Vec2& p : profile) {
    rings.push_back(
        circle(centre + Vec3(0.0F, p.x() * width, 0.0F), Vec3::UnitY(), p.y() * radius, kSides));
  }
  const auto material = [&](std::size_t interval, std::size_t) {
    return interval < 4 ? look.rubber : look.rim;
  };
  b.loft(rings, material, look.rubber, look.spokes > 0 ? look.dark : look.rim, 35.0F);
  const Vec3 hub = centre + Vec3(0.0F, 0.4F * width, 0.0F);
  if (look.spokes > 0) {
    const float half = 0.36F * rim * radius / std::sqrt(static_cast<float>(look.spokes));
    addSpokes(b, hub, 0.98F * (rim - 0.02F) * radius, half, look.spokes, look.rim);
  }
  b.tube(centre + Vec3(0.0F, 0.28F * width, 0.0F), hub + Vec3(0.0F, 0.03F * width, 0.0F),
         0.2F * radius, 0.16F * radius, 6, look.rim);
}

BodyMaterials vehicleMaterials(MeshBuilder& builder, const Order& order, const Vec3& paint,
                               Dice& dice) {
  const auto film = sharedTexture(TextureKind::kCarPaint, order.look_seed, dice, 128);
  const bool matt_trim = dice.chance(0.5F);
  BodyMaterials m{};
  m.paint =
      builder.material(textured(paint, film, 0.6F), 2.0F * static_cast<float>(order.size.z()));
  m.trim = matt_trim ? builder.material(plain({0.03F, 0.03F, 0.032F}, 0.1F)) : m.paint;
  m.glass = builder.material(glass(dice));
  m.headlight = builder.material(plain({0.75F, 0.76F, 0.78F}, 0.8F));
  m.taillight = builder.material(plain({0.42F, 0.012F, 0.012F}, 0.7F));
  m.plate = builder.material(plain({0.8F, 0.8F, 0.78F}, 0.2F));
  m.dark = builder.material(plain({0.012F, 0.012F, 0.013F}, 0.05F));
  return m;
}

void addWheels(MeshBuilder& builder, const BodyProfile& p, const Vec3& size, Dice& dice) {
  WheelLook look;
  look.rubber = builder.material(rubber());
  const float tone = dice.uniform(0.12F, 0.6F);
  look.rim = builder.material(plain({tone, tone, tone}, 0.5F));
  look.dark = builder.material(plain({0.02F, 0.02F, 0.02F}));
  look.spokes = std::array<int, 6>{0, 5, 5, 6, 7, 10}[static_cast<std::size_t>(dice.below(6))];
  look.rim_share = dice.uniform(0.62F, 0.74F);
  const float r = p.wheel_radius * size.z(), width = 0.115F * size.y();
  for (float side : {1.0F, -1.0F}) {
    for (float axle : {p.front_axle, p.rear_axle}) {
      builder.placing = Eigen::Affine3f(Eigen::Scaling(1.0F, side, 1.0F));
      const Vec3 centre((0.5F - axle) * size.x(), 0.488F * size.y() - width / 2.0F, r);
      addWheel(builder, centre, r, width, look);
    }
  }
  builder.placing.setIdentity();
}

}  // namespace

void addVehicle(MeshBuilder& builder, const BodyProfile& profile, const Order& order, Dice& dice,
                bool roof_rails) {
  const Vec3 full = order.size.cast<float>();
  const Vec3 size(full.x(), kBodyShare * full.y(), full.z());
  const BodyMaterials m = vehicleMaterials(builder, order, paintColour(dice), dice);
  addBody(builder, profile, size, m);
  addWheels(builder, profile, size, dice);
  addMirrors(builder, profile, size, full.y(), dice.chance(0.6F) ? m.paint : m.dark);
  addHandles(builder, profile, size, dice.chance(0.7F) ? m.paint : m.dark);
  if (roof_rails) addRails(builder, profile, size, builder.material(chrome()));
}

}  // namespace perdure::tools::shapes

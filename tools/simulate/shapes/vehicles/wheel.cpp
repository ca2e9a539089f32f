#include "tools/simulate/shapes/vehicles/wheel.h"

#include <array>
#include <cmath>

namespace perdure::tools::shapes {
namespace {

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

}  // namespace

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

}  // namespace perdure::tools::shapes

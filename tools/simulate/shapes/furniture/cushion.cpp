#include "tools/simulate/shapes/furniture/cushion.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace perdure::tools::shapes {

void addCushion(MeshBuilder& b, const Vec3& low, const Vec3& high, float round, int material) {
  const Vec3 centre = (low + high) / 2.0F, half = (high - low) / 2.0F;
  std::vector<Ring> rings;
  for (float level : {-1.0F, -0.75F, 0.75F, 1.0F}) {
    const float in = level * level > 0.9F ? round : 0.0F;
    const float x = half.x() - in, y = half.y() - in, corner = 0.8F * std::min({round, x, y});
    const float z = centre.z() + level * half.z();
    Ring ring;
    for (const auto& [sx, sy] : {std::pair(1.0F, 1.0F), std::pair(-1.0F, 1.0F),
                                 std::pair(-1.0F, -1.0F), std::pair(1.0F, -1.0F)}) {
      const Vec3 first(sx * (sx * sy > 0.0F ? x : x - corner),
                       sy * (sx * sy > 0.0F ? y - corner : y), 0.0F);
      const Vec3 second(sx * (sx * sy > 0.0F ? x - corner : x),
                        sy * (sx * sy > 0.0F ? y : y - corner), 0.0F);
      for (const Vec3& p : {first, second})
        ring.emplace_back(centre.x() + p.x(), centre.y() + p.y(), z);
    }
    rings.push_back(std::move(ring));
  }
  b.loft(rings, material, 60.0F);
}

}  // namespace perdure::tools::shapes

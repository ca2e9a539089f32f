// Wheel of a road vehicle: tyre, rim, spokes, hub.
#pragma once

#include "tools/simulate/shapes/mesh_builder.h"

namespace perdure::tools::shapes {

struct WheelLook {
  int rubber = 0, rim = 0, dark = 0;  ///< indices of materials
  int spokes = 5;                     ///< 0: a closed disc
  float rim_share = 0.66F;            ///< share of the radius
};
/// The axle points to +y (outside), before the builder's transform.
void addWheel(MeshBuilder& builder, const Vec3& centre, float radius, float width,
              const WheelLook& look);

}  // namespace perdure::tools::shapes

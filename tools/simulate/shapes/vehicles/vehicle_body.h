// The lofted body of a road vehicle, with wheel arches, glass, lights, seams and plates.
#pragma once

#include <vector>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/mesh_builder.h"

namespace perdure::tools::shapes {

struct Span {
  float from = 0.0F, to = 0.0F;
  bool holds(float x) const { return x > from && x < to; }
};

/// Side view of a body: x is the share of the length from the front, z the share of the height.
struct BodyProfile {
  std::vector<Vec2> top;   ///< outline seen from the side, x increasing, from 0 to 1
  std::vector<Vec2> belt;  ///< lower edge of the windows
  Span windscreen, rear_glass;
  std::vector<Span> side_glass;
  std::vector<float> seams;  ///< seams of doors
  float front_axle = 0.18F, rear_axle = 0.8F;
  float wheel_radius = 0.22F, sill = 0.15F;  ///< shares of the height
  float roof_width = 0.76F;                  ///< share of the width
  float nose_taper = 0.18F, tail_taper = 0.1F;
  bool rear_doors_with_glass = false;  ///< vans with a vertical rear end
  bool split_grille = true;
};

struct BodyMaterials {
  int paint, trim, glass, headlight, taillight, plate, dark;
};

/// Adds the body from x = +length/2 (front) to −length/2, with the wheels on z = 0. `size` in
/// metres.
void addBody(MeshBuilder& builder, const BodyProfile& profile, const Vec3& size,
             const BodyMaterials& materials);

/// Value at x of the polyline through the points; constant outside.
float lineAt(const std::vector<Vec2>& points, float x);

}  // namespace perdure::tools::shapes

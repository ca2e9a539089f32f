// Turns loose faces into a mesh: exact size, smooth normals up to a crease angle, merged corners.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

struct LooseFace {
  std::array<Eigen::Vector3f, 3> corners;  ///< counter-clockwise seen from outside
  std::array<Eigen::Vector2f, 3> uvs;
  bool has_uvs = false;
  std::uint16_t material = 0;
  std::uint32_t part = 0;  ///< faces of different parts are not smoothed together
  float repeat_m = 1.0F, crease_deg = 40.0F;
};

/// Scales each axis and centres the faces, so that their box is exactly `size` (in float).
void fitTo(const Eigen::Vector3d& size, std::vector<LooseFace>& faces);
/// Joins faces; normals are weighted by angle. Positions give missing texture coordinates.
Mesh joinFaces(const std::vector<LooseFace>& faces, const std::vector<Material>& materials);

}  // namespace perdure::tools::shapes

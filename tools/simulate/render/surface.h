// Shading data of surfaces, in addition to Embree's copy of their corners.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/math/rigid_transform.h"
#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools {

/// Shading data of a triangle, in one block because rays hit triangles in random order.
struct Facet {
  std::array<Eigen::Vector3f, 3> normals;
  std::array<Eigen::Vector2f, 3> uvs;
  float repeats_per_metre = 0.0F;  ///< density of the texture
  std::uint32_t material = 0;
};

struct Surface {
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Facet> facets;  ///< data of each triangle
  std::vector<Material> materials;

  /// Adds `mesh`, placed by T_SM. Throws std::invalid_argument if its lists differ in length.
  void add(const Mesh& mesh, const RigidTransform& T_SM = {});
};

/// A hit point on a surface, interpolated between the triangle's corners.
struct SurfacePoint {
  Eigen::Vector3f normal;  ///< surface frame; not normalised
  Eigen::Vector2f uv;
  float repeats_per_metre = 0.0F;
  const Material* material = nullptr;
  std::uint32_t material_index = 0;
};
SurfacePoint pointOn(const Surface& surface, std::uint32_t triangle, float u, float v);

}  // namespace perdure::tools

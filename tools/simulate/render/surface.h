// What the renderer needs to know of a hit triangle, beside Embree's own copy of its corners.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/math/rigid_transform.h"
#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools {

/// What shading reads of a triangle, in one piece: rays meet triangles in no order.
struct Facet {
  std::array<Eigen::Vector3f, 3> normals;
  std::array<Eigen::Vector2f, 3> uvs;
  float repeats_per_metre = 0.0F;  ///< of the texture
  std::uint32_t material = 0;
};

/// One or more meshes in one frame.
struct Surface {
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Facet> facets;  ///< of each triangle
  std::vector<Material> materials;

  /// Adds `mesh`, placed by T_SM. Throws std::invalid_argument where its lists do not fit together.
  void add(const Mesh& mesh, const RigidTransform& T_SM = {});
};

/// The place on a surface that a ray met, interpolated between the triangle's corners.
struct SurfacePoint {
  Eigen::Vector3f normal;  ///< in the surface's frame, not of unit length
  Eigen::Vector2f uv;
  float repeats_per_metre = 0.0F;
  const Material* material = nullptr;
  std::uint32_t material_index = 0;
};
SurfacePoint pointOn(const Surface& surface, std::uint32_t triangle, float u, float v);

}  // namespace perdure::tools

// What the renderer needs to know of a hit triangle, beside Embree's own copy of its corners.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/math/rigid_transform.h"
#include "tools/simulate/mesh.h"

namespace perdure::tools {

/// One or more meshes in one frame.
struct Surface {
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<Eigen::Vector2f> uvs;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> material_of;
  std::vector<float> repeats_per_metre;  ///< of the texture, by triangle
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

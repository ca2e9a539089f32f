#include "tools/simulate/render/surface.h"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

namespace perdure::tools {
namespace {

void require(const Mesh& mesh) {
  const std::size_t corners = mesh.positions.size();
  bool fits = mesh.normals.size() == corners && mesh.uvs.size() == corners &&
              mesh.material_of.size() == mesh.triangles.size();
  for (const auto& triangle : mesh.triangles) {
    for (const auto index : triangle) fits = fits && index < corners;
  }
  for (const auto index : mesh.material_of) fits = fits && index < mesh.materials.size();
  if (!fits) throw std::invalid_argument("a mesh has lists that do not fit together");
}

/// Texture repeats per metre: square root of the texture's area divided by the triangle's.
float repeatsPerMetre(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const auto& p = mesh.positions;
  const auto& uv = mesh.uvs;
  const float area = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm();
  const Eigen::Vector2f a = uv[t[1]] - uv[t[0]], b = uv[t[2]] - uv[t[0]];
  return std::sqrt(std::abs(a.x() * b.y() - a.y() * b.x()) / std::max(area, 1e-12F));
}

}  // namespace

void Surface::add(const Mesh& mesh, const RigidTransform& T_SM) {
  require(mesh);
  const auto first = static_cast<std::uint32_t>(positions.size());
  const auto first_material = static_cast<std::uint32_t>(materials.size());
  const Eigen::Matrix3f R = T_SM.R().cast<float>();
  const Eigen::Vector3f p = T_SM.p.cast<float>();
  for (const auto& position : mesh.positions) positions.emplace_back(R * position + p);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    triangles.push_back({first + t[0], first + t[1], first + t[2]});
    Facet facet;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      facet.normals[corner] = R * mesh.normals[t[corner]];
      facet.uvs[corner] = mesh.uvs[t[corner]];
    }
    facet.repeats_per_metre = repeatsPerMetre(mesh, t);
    facet.material = first_material + mesh.material_of[i];
    facets.push_back(facet);
  }
  materials.insert(materials.end(), mesh.materials.begin(), mesh.materials.end());
}

SurfacePoint pointOn(const Surface& surface, std::uint32_t triangle, float u, float v) {
  const Facet& facet = surface.facets[triangle];
  const float w = 1.0F - u - v;
  SurfacePoint point;
  point.normal = w * facet.normals[0] + u * facet.normals[1] + v * facet.normals[2];
  point.uv = w * facet.uvs[0] + u * facet.uvs[1] + v * facet.uvs[2];
  point.repeats_per_metre = facet.repeats_per_metre;
  point.material_index = facet.material;
  point.material = &surface.materials[facet.material];
  return point;
}

}  // namespace perdure::tools

// Triangles with normals, texture coordinates and materials; in metres, corners counter-clockwise.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/sim/scene.h"
#include "tools/simulate/shapes/texture.h"

namespace perdure::tools {

struct Material {
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< linear RGB reflectance; the texture multiplies it
  std::shared_ptr<const Texture> texture;    ///< may be null
  float gloss = 0.0F;  ///< 0 matt … 1 mirror-like: share of the sky's reflection at grazing angles
  float emission = 0.0F;   ///< emitted light (screens, lamps)
  bool two_sided = false;  ///< true for leaves and sheets
};

struct Mesh {
  std::vector<Eigen::Vector3f> positions, normals;  ///< equal lengths; normals have unit length
  std::vector<Eigen::Vector2f> uvs;                 ///< equal length; in units of texture repeats
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> material_of;  ///< index into materials of each triangle
  std::vector<Material> materials;
};

/// Mesh in O with a centred box of exactly `object.size`. Throws std::invalid_argument for an
/// unknown shape.
Mesh makeObjectMesh(const sim::SceneObject& object);
Mesh makePropMesh(const sim::Prop& prop);
/// Mesh of the ground in W, with roads, pavements and markings, or of a room's floor.
Mesh makeGroundMesh(const sim::Scene& scene);

}  // namespace perdure::tools

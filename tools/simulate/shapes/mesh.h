// Triangles with normals, texture coordinates and materials; how the generated shapes are handed to
// the renderer. Units are metres, right-handed, counter-clockwise seen from outside.
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
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< linear RGB reflectance, times the texture's
  std::shared_ptr<const Texture> texture;    ///< may be null
  float gloss = 0.0F;  ///< 0 matt … 1 mirror-like: share of the sky's reflection at grazing angles
  float emission = 0.0F;   ///< light of its own (screens, lamps)
  bool two_sided = false;  ///< leaves, sheets
};

struct Mesh {
  std::vector<Eigen::Vector3f> positions, normals;  ///< same length; normals are of unit length
  std::vector<Eigen::Vector2f> uvs;                 ///< same length; in units of texture repeats
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> material_of;  ///< of each triangle, index into materials
  std::vector<Material> materials;
};

/// In frame O, its bounding box exactly `object.size`, centred. Throws std::invalid_argument for a
/// class or shape that is not known.
Mesh makeObjectMesh(const sim::SceneObject& object);
Mesh makePropMesh(const sim::Prop& prop);
/// The ground around the scene in W, with roads, pavements, markings (or a room's floor).
Mesh makeGroundMesh(const sim::Scene& scene);

}  // namespace perdure::tools

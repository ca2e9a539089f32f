// Builds a mesh part by part, with smooth normals up to a crease, fitted to a size.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "tools/simulate/shapes/mesh_finish.h"

namespace perdure::tools::shapes {

using Vec2 = Eigen::Vector2f;
using Vec3 = Eigen::Vector3f;
using Ring = std::vector<Vec3>;
inline constexpr float kPi = std::numbers::pi_v<float>;

class MeshBuilder {
 public:
  /// `repeat_m` is the width of one texture repeat for faces without texture coordinates. These use
  /// the two coordinates across the face's main direction.
  int material(const Material& material, float repeat_m = 1.0F);

  /// Starts a new part. Faces of different parts share no smooth normals. Faces that meet at more
  /// than `crease_deg` keep an edge. Inverted meshes are not detected: see `closed`.
  void begin(float crease_deg = 40.0F);
  /// Orients the last part so that its volume is positive; for closed parts.
  void closed();

  /// Adds a triangle, counter-clockwise seen from outside. Omits faces without area.
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, int material);
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material);
  /// Adds a face with texture coordinates: a (0, 0), b (1, 0), c (1, 1), d (0, 1), times `repeats`.
  void picture(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material,
               const Vec2& repeats = Vec2::Ones());

  /// Closed parts, each of which calls begin.
  void box(const Vec3& low, const Vec3& high, int material);
  /// A tube from a to b, with radius_a at a and radius_b at b.
  void tube(const Vec3& a, const Vec3& b, float radius_a, float radius_b, int sides, int material);
  /// A tube through the points, with round cross-sections of the given radii (one for each point).
  void pipe(const std::vector<Vec3>& points, const std::vector<float>& radii, int sides,
            int material);
  void ellipsoid(const Vec3& centre, const Vec3& radii, int sides, int stacks, int material);
  /// A ring with round cross-section about an axis of unit length.
  void torus(const Vec3& centre, const Vec3& axis, float radius, float thickness, int sides,
             int section, int material);

  using MaterialOf = std::function<int(std::size_t interval, std::size_t segment)>;
  /// Faces over closed rings of equal length, in the last part.
  void skin(const std::vector<Ring>& rings, const MaterialOf& material_of);
  /// A closed part: a skin with fans at its ends (open without a material for them).
  void loft(const std::vector<Ring>& rings, const MaterialOf& material_of,
            std::optional<int> first_cap, std::optional<int> last_cap, float crease_deg = 40.0F);
  /// Adds such a surface of one material, with both ends.
  void loft(const std::vector<Ring>& rings, int material, float crease_deg);

  /// Transform of all faces that are added while it is set. A mirror reverses the order of corners.
  Eigen::Affine3f placing = Eigen::Affine3f::Identity();

  /// Scales the bounding box to exactly `size`, centred; without a size, nothing is moved.
  Mesh finish(const std::optional<Eigen::Vector3d>& size) const;

 private:
  void add(LooseFace face);
  void fan(const Ring& ring, int material, bool turned);

  std::vector<LooseFace> faces_;
  std::vector<Material> materials_;
  std::vector<float> repeats_;
  std::uint32_t part_ = 0;
  float crease_deg_ = 40.0F;
  std::size_t part_start_ = 0;
};

/// A circle about the axis at centre, counter-clockwise seen from the tip of the axis.
Ring circle(const Vec3& centre, const Vec3& axis, float radius, int sides, float phase = 0.0F);

}  // namespace perdure::tools::shapes

// Builds a mesh part by part, with smooth normals up to a crease angle, and fits it to a size.
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
  /// Faces without texture coordinates repeat the texture every `repeat_m`; they use the two
  /// coordinates across the face's main direction.
  int material(const Material& material, float repeat_m = 1.0F);

  /// Starts a new part. Faces of different parts have no common smooth normals. Faces that meet at
  /// over `crease_deg` form an edge. A part that is inside out is not detected; closed() corrects
  /// it.
  void begin(float crease_deg = 40.0F);
  /// Orients the last part so that its volume is positive. The part must be closed.
  void closed();

  /// Adds a triangle, counter-clockwise seen from outside. Omits faces without area.
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, int material);
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material);
  /// Adds a face with texture coordinates: a (0, 0), b (1, 0), c (1, 1), d (0, 1), times `repeats`.
  void picture(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material,
               const Vec2& repeats = Vec2::Ones());

  /// Adds a closed part; box, tube, pipe, ellipsoid and torus call begin.
  void box(const Vec3& low, const Vec3& high, int material);
  /// Adds a tube from a to b, with radius_a at a and radius_b at b.
  void tube(const Vec3& a, const Vec3& b, float radius_a, float radius_b, int sides, int material);
  /// Adds a tube through the points, with round cross-sections of the given radii, one per point.
  void pipe(const std::vector<Vec3>& points, const std::vector<float>& radii, int sides,
            int material);
  void ellipsoid(const Vec3& centre, const Vec3& radii, int sides, int stacks, int material);
  /// Adds a ring with a round cross-section about an axis of unit length.
  void torus(const Vec3& centre, const Vec3& axis, float radius, float thickness, int sides,
             int section, int material);

  using MaterialOf = std::function<int(std::size_t interval, std::size_t segment)>;
  /// Adds faces between consecutive closed rings of equal length to the last part.
  void skin(const std::vector<Ring>& rings, const MaterialOf& material_of);
  /// Adds a part: a skin with a fan at each end that has a material; other ends stay open.
  void loft(const std::vector<Ring>& rings, const MaterialOf& material_of,
            std::optional<int> first_cap, std::optional<int> last_cap, float crease_deg = 40.0F);
  /// Adds a loft of one material with both ends.
  void loft(const std::vector<Ring>& rings, int material, float crease_deg);

  /// Transform of all faces that are added from now on. A mirror reverses the order of corners.
  Eigen::Affine3f placing = Eigen::Affine3f::Identity();

  /// Returns the mesh, centred and scaled to a box of exactly `size`; unchanged without a size.
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

/// A circle about the axis at `centre`, counter-clockwise seen from the tip of the axis.
Ring circle(const Vec3& centre, const Vec3& axis, float radius, int sides, float phase = 0.0F);

}  // namespace perdure::tools::shapes

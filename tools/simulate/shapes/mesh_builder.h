// Builds a mesh part by part: faces in, smooth normals by a crease angle and fitted size out.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

using Vec2 = Eigen::Vector2f;
using Vec3 = Eigen::Vector3f;
using Ring = std::vector<Vec3>;
inline constexpr float kPi = std::numbers::pi_v<float>;

class MeshBuilder {
 public:
  MeshBuilder() { begin(); }

  /// `repeat_m` is the width of one texture repeat where a face brings no coordinates of its own
  /// (they are then its two coordinates across its main direction).
  int material(const Material& material, float repeat_m = 1.0F);

  /// A new part: faces of different parts share no smooth normals. Faces that meet at more than
  /// `crease_deg` keep an edge. Meshes inside out are not noticed: see `closed`.
  void begin(float crease_deg = 40.0F);
  /// Turns the part begun last so that its volume is positive: for closed parts.
  void closed();

  /// Counter-clockwise seen from outside. Faces without area are left out.
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, int material);
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material);
  /// The same with texture coordinates: a (0, 0), b (1, 0), c (1, 1), d (0, 1), times `repeats`.
  void picture(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material,
               const Vec2& repeats = Vec2::Ones());

  /// Closed parts, each with a begin of its own.
  void box(const Vec3& low, const Vec3& high, int material);
  /// Round about the way from a to b; radius at both ends.
  void tube(const Vec3& a, const Vec3& b, float radius_a, float radius_b, int sides, int material);
  /// Through the points, with round cross-sections of the radii given (one for each point).
  void pipe(const std::vector<Vec3>& points, const std::vector<float>& radii, int sides,
            int material);
  void ellipsoid(const Vec3& centre, const Vec3& radii, int sides, int stacks, int material);
  /// A ring of round cross-section about an axis of unit length.
  void torus(const Vec3& centre, const Vec3& axis, float radius, float thickness, int sides,
             int section, int material);

  using MaterialOf = std::function<int(std::size_t interval, std::size_t segment)>;
  /// Faces over closed rings of equal length, in the part begun last.
  void skin(const std::vector<Ring>& rings, const MaterialOf& material_of);
  /// A closed part: a skin whose ends are fans (or open without a material for them).
  void loft(const std::vector<Ring>& rings, const MaterialOf& material_of,
            std::optional<int> first_cap, std::optional<int> last_cap, float crease_deg = 40.0F);

  /// What is added while it is in force is mapped by it (a mirror turns faces round).
  Eigen::Affine3f placing = Eigen::Affine3f::Identity();

  std::size_t triangleCount() const { return faces_.size(); }
  /// The bounding box becomes exactly `size`, centred; without a size nothing is moved.
  Mesh finish(const std::optional<Eigen::Vector3d>& size) const;

 private:
  struct Face {
    std::array<Vec3, 3> corners;
    std::array<Vec2, 3> uvs;
    bool has_uvs = false;
    std::uint16_t material = 0;
    std::uint32_t part = 0;
  };
  void add(Face face);
  void fan(const Ring& ring, int material, bool turned);

  std::vector<Face> faces_;
  std::vector<Material> materials_;
  std::vector<float> repeats_;
  std::vector<float> creases_;
  std::size_t part_start_ = 0;
};

/// A circle about the axis at centre, counter-clockwise seen from the axis' tip.
Ring circle(const Vec3& centre, const Vec3& axis, float radius, int sides, float phase = 0.0F);

}  // namespace perdure::tools::shapes

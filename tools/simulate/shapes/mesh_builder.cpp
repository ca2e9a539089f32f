#include "tools/simulate/shapes/mesh_builder.h"

#include <cmath>
#include <utility>

namespace perdure::tools::shapes {
namespace {

constexpr float kLeastArea = 1e-9F;  // m²; smaller triangles are omitted

Vec3 across(const Vec3& axis) {
  const Vec3 other = std::abs(axis.z()) < 0.9F ? Vec3::UnitZ() : Vec3::UnitX();
  return other.cross(axis).normalized();
}

Vec3 centreOf(const Ring& ring) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : ring) sum += p;
  return sum / static_cast<float>(ring.size());
}

}  // namespace

Ring circle(const Vec3& centre, const Vec3& axis, float radius, int sides, float phase) {
  const Vec3 u = across(axis), v = axis.cross(u);
  Ring ring;
  for (int i = 0; i < sides; ++i) {
    const float a = phase + 2.0F * kPi * static_cast<float>(i) / static_cast<float>(sides);
    ring.push_back(centre + radius * (std::cos(a) * u + std::sin(a) * v));
  }
  return ring;
}

int MeshBuilder::material(const Material& material, float repeat_m) {
  materials_.push_back(material);
  repeats_.push_back(repeat_m);
  return static_cast<int>(materials_.size()) - 1;
}

void MeshBuilder::begin(float crease_deg) {
  ++part_;
  crease_deg_ = crease_deg;
  part_start_ = faces_.size();
}

void MeshBuilder::closed() {
  if (part_start_ == faces_.size()) return;
  const Vec3 origin = faces_[part_start_].corners[0];
  double volume = 0.0;
  for (std::size_t i = part_start_; i < faces_.size(); ++i) {
    const auto& c = faces_[i].corners;
    volume +=
        (c[0] - origin).cross(c[1] - origin).cast<double>().dot((c[2] - origin).cast<double>());
  }
  if (volume >= 0.0) return;
  for (std::size_t i = part_start_; i < faces_.size(); ++i) {
    std::swap(faces_[i].corners[1], faces_[i].corners[2]);
    std::swap(faces_[i].uvs[1], faces_[i].uvs[2]);
  }
}

void MeshBuilder::add(LooseFace face) {
  for (Vec3& corner : face.corners) corner = placing * corner;
  if (placing.linear().determinant() < 0.0F) {
    std::swap(face.corners[1], face.corners[2]);
    std::swap(face.uvs[1], face.uvs[2]);
  }
  const auto& c = face.corners;
  if ((c[1] - c[0]).cross(c[2] - c[0]).norm() < kLeastArea) return;
  face.part = part_;
  face.repeat_m = repeats_[face.material];
  face.crease_deg = crease_deg_;
  faces_.push_back(face);
}

void MeshBuilder::triangle(const Vec3& a, const Vec3& b, const Vec3& c, int material) {
  add({.corners = {a, b, c},
       .uvs = {Vec2::Zero(), Vec2::Zero(), Vec2::Zero()},
       .material = static_cast<std::uint16_t>(material)});
}

void MeshBuilder::quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material) {
  triangle(a, b, c, material);
  triangle(a, c, d, material);
}

void MeshBuilder::picture(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, int material,
                          const Vec2& repeats) {
  const Vec2 right(repeats.x(), 0.0F), up(0.0F, repeats.y());
  const auto m = static_cast<std::uint16_t>(material);
  add({{a, b, c}, {Vec2::Zero(), right, repeats}, true, m});
  add({{a, c, d}, {Vec2::Zero(), repeats, up}, true, m});
}

void MeshBuilder::box(const Vec3& low, const Vec3& high, int material) {
  begin();
  const auto corner = [&](int i) {
    return Vec3((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                (i & 4) != 0 ? high.z() : low.z());
  };
  constexpr std::array<std::array<int, 4>, 6> kSides{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& s : kSides)
    quad(corner(s[0]), corner(s[1]), corner(s[2]), corner(s[3]), material);
}

void MeshBuilder::tube(const Vec3& a, const Vec3& b, float radius_a, float radius_b, int sides,
                       int material) {
  pipe({a, b}, {radius_a, radius_b}, sides, material);
}

void MeshBuilder::pipe(const std::vector<Vec3>& points, const std::vector<float>& radii, int sides,
                       int material) {
  std::vector<Ring> rings;
  Vec3 u = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& before = points[i == 0 ? 0 : i - 1];
    const Vec3& after = points[i + 1 < points.size() ? i + 1 : i];
    const Vec3 axis = (after - before).normalized();
    u = i == 0 ? across(axis) : (u - u.dot(axis) * axis).normalized();
    const Vec3 v = axis.cross(u);
    Ring ring;
    for (int k = 0; k < sides; ++k) {
      const float angle = 2.0F * kPi * static_cast<float>(k) / static_cast<float>(sides);
      ring.push_back(points[i] + radii[i] * (std::cos(angle) * u + std::sin(angle) * v));
    }
    rings.push_back(std::move(ring));
  }
  loft(rings, material, 50.0F);
}

void MeshBuilder::ellipsoid(const Vec3& centre, const Vec3& radii, int sides, int stacks,
                            int material) {
  std::vector<Ring> rings;
  for (int i = 1; i < stacks; ++i) {
    const float latitude = kPi * (static_cast<float>(i) / static_cast<float>(stacks) - 0.5F);
    Ring ring =
        circle(Vec3::UnitZ() * std::sin(latitude), Vec3::UnitZ(), std::cos(latitude), sides);
    for (Vec3& p : ring) p = centre + p.cwiseProduct(radii);
    rings.push_back(std::move(ring));
  }
  begin(80.0F);
  const Vec3 bottom = centre - Vec3::UnitZ() * radii.z(), top = centre + Vec3::UnitZ() * radii.z();
  const std::size_t n = rings.front().size();
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t next = (k + 1) % n;
    triangle(bottom, rings.front()[next], rings.front()[k], material);
    for (std::size_t i = 0; i + 1 < rings.size(); ++i) {
      quad(rings[i][k], rings[i][next], rings[i + 1][next], rings[i + 1][k], material);
    }
    triangle(rings.back()[k], rings.back()[next], top, material);
  }
}

void MeshBuilder::torus(const Vec3& centre, const Vec3& axis, float radius, float thickness,
                        int sides, int section, int material) {
  const Ring spine = circle(centre, axis, radius, sides);
  std::vector<Ring> rings;
  for (const Vec3& p : spine) {
    const Vec3 out = (p - centre).normalized();
    Ring ring;
    for (int k = 0; k < section; ++k) {
      const float a = 2.0F * kPi * static_cast<float>(k) / static_cast<float>(section);
      ring.push_back(p + thickness * (std::cos(a) * out + std::sin(a) * axis));
    }
    rings.push_back(std::move(ring));
  }
  rings.push_back(rings.front());
  loft(
      rings, [material](std::size_t, std::size_t) { return material; }, {}, {}, 80.0F);
}

void MeshBuilder::fan(const Ring& ring, int material, bool turned) {
  const Vec3 centre = centreOf(ring);
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec3 &a = ring[k], &b = ring[(k + 1) % ring.size()];
    triangle(centre, turned ? b : a, turned ? a : b, material);
  }
}

void MeshBuilder::skin(const std::vector<Ring>& rings, const MaterialOf& material_of) {
  for (std::size_t i = 0; i + 1 < rings.size(); ++i) {
    const std::size_t n = rings[i].size();
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      quad(rings[i][k], rings[i][next], rings[i + 1][next], rings[i + 1][k], material_of(i, k));
    }
  }
}

void MeshBuilder::loft(const std::vector<Ring>& rings, const MaterialOf& material_of,
                       std::optional<int> first_cap, std::optional<int> last_cap,
                       float crease_deg) {
  begin(crease_deg);
  skin(rings, material_of);
  if (first_cap) fan(rings.front(), *first_cap, true);
  if (last_cap) fan(rings.back(), *last_cap, false);
  closed();
}

void MeshBuilder::loft(const std::vector<Ring>& rings, int material, float crease_deg) {
  loft(
      rings, [material](auto, auto) { return material; }, material, material, crease_deg);
}

Mesh MeshBuilder::finish(const std::optional<Eigen::Vector3d>& size) const {
  std::vector<LooseFace> loose = faces_;
  if (size) fitTo(*size, loose);
  return joinFaces(loose, materials_);
}

}  // namespace perdure::tools::shapes

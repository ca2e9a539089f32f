#include "tools/simulate/shapes/mesh_finish.h"

#include <cmath>
#include <numbers>
#include <string_view>
#include <unordered_map>

namespace perdure::tools::shapes {
namespace {

using Vec2 = Eigen::Vector2f;
using Vec3 = Eigen::Vector3f;

constexpr float kWeldStep = 1e-5F;  // m; closer corners are merged

Vec3 crossOf(const LooseFace& face) {
  return (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]);
}

float angleAt(const LooseFace& face, std::size_t corner) {
  const Vec3 a = (face.corners[(corner + 1) % 3] - face.corners[corner]).normalized();
  const Vec3 b = (face.corners[(corner + 2) % 3] - face.corners[corner]).normalized();
  return std::acos(std::clamp(a.dot(b), -1.0F, 1.0F));
}

struct Place {
  std::int32_t x = 0, y = 0, z = 0;
  std::uint32_t part = 0;
  bool operator==(const Place&) const = default;
};
struct PlaceHash {
  std::size_t operator()(const Place& p) const {
    return std::hash<std::string_view>()({reinterpret_cast<const char*>(&p), sizeof(p)});
  }
};

Place placeOf(const Vec3& p, std::uint32_t part) {
  const Vec3 cell = p / kWeldStep;
  return {static_cast<std::int32_t>(std::lround(cell.x())),
          static_cast<std::int32_t>(std::lround(cell.y())),
          static_cast<std::int32_t>(std::lround(cell.z())), part};
}

struct Use {
  std::size_t face, corner;
};
using Uses = std::unordered_map<Place, std::vector<Use>, PlaceHash>;

Vec3 smoothNormal(const std::vector<LooseFace>& faces, const std::vector<Vec3>& normals,
                  const std::vector<Use>& around, std::size_t face) {
  const float least = std::cos(faces[face].crease_deg * std::numbers::pi_v<float> / 180.0F);
  Vec3 sum = Vec3::Zero();
  for (const Use& use : around) {
    if (use.face != face && normals[use.face].dot(normals[face]) < least) continue;
    sum += angleAt(faces[use.face], use.corner) * normals[use.face];
  }
  const float length = sum.norm();
  return length > 1e-6F ? Vec3(sum / length) : normals[face];
}

Vec2 flatUv(const Vec3& p, const Vec3& normal, float repeat_m) {
  const Vec3 size = normal.cwiseAbs();
  if (size.z() >= size.x() && size.z() >= size.y()) return Vec2(p.x(), p.y()) / repeat_m;
  if (size.x() >= size.y()) return Vec2(p.y(), p.z()) / repeat_m;
  return Vec2(p.x(), p.z()) / repeat_m;
}

struct VertexKey {
  std::array<float, 8> values;
  bool operator==(const VertexKey&) const = default;
};
struct VertexHash {
  std::size_t operator()(const VertexKey& k) const {
    return std::hash<std::string_view>()(
        {reinterpret_cast<const char*>(k.values.data()), sizeof(k.values)});
  }
};

std::uint32_t vertexOf(const Vec3& p, const Vec3& n, const Vec2& uv, Mesh& mesh,
                       std::unordered_map<VertexKey, std::uint32_t, VertexHash>& known) {
  // Adding zero changes −0 to 0, so that equal numbers have equal bytes.
  const VertexKey key{{p.x() + 0.0F, p.y() + 0.0F, p.z() + 0.0F, n.x() + 0.0F, n.y() + 0.0F,
                       n.z() + 0.0F, uv.x() + 0.0F, uv.y() + 0.0F}};
  const auto [at, fresh] =
      known.try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size()));
  if (fresh) {
    mesh.positions.push_back(p);
    mesh.normals.push_back(n);
    mesh.uvs.push_back(uv);
  }
  return at->second;
}

}  // namespace

void fitTo(const Eigen::Vector3d& size, std::vector<LooseFace>& faces) {
  Eigen::AlignedBox3f bounds;
  for (const LooseFace& face : faces) {
    for (const Vec3& corner : face.corners) bounds.extend(corner);
  }
  const Vec3 half = (size / 2.0).cast<float>();
  const Vec3 extent = bounds.sizes().cwiseMax(1e-9F);
  for (LooseFace& face : faces) {
    for (Vec3& corner : face.corners) {
      const Vec3 share = (corner - bounds.min()).cwiseQuotient(extent).cwiseMin(1.0F);
      corner = 2.0F * half.cwiseProduct(share) - half;
    }
  }
}

Mesh joinFaces(const std::vector<LooseFace>& faces, const std::vector<Material>& materials) {
  Uses uses;
  std::vector<Vec3> normals;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    normals.push_back(crossOf(faces[f]).normalized());
    for (std::size_t c = 0; c < 3; ++c) {
      uses[placeOf(faces[f].corners[c], faces[f].part)].push_back({f, c});
    }
  }
  Mesh mesh;
  mesh.materials = materials;
  std::unordered_map<VertexKey, std::uint32_t, VertexHash> known;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const LooseFace& face = faces[f];
    std::array<std::uint32_t, 3> indices{};
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& around = uses.at(placeOf(face.corners[c], face.part));
      const Vec3 n = smoothNormal(faces, normals, around, f);
      const Vec2 uv =
          face.has_uvs ? face.uvs[c] : flatUv(face.corners[c], normals[f], face.repeat_m);
      indices[c] = vertexOf(face.corners[c], n, uv, mesh, known);
    }
    mesh.triangles.push_back(indices);
    mesh.material_of.push_back(face.material);
  }
  return mesh;
}

}  // namespace perdure::tools::shapes

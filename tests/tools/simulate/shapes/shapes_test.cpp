// Tests the generated shapes: exact sizes, valid meshes, an appearance that depends only on the
// seed.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tools/simulate/shapes/mesh.h"
#include "tools/simulate/shapes/texture.h"

namespace perdure::tools {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

struct Sample {
  std::string name;
  Vector3d size;
  Mesh mesh;
};

struct Kind {
  std::string class_name;
  Vector3d size;
  std::vector<std::string> shapes;
  std::size_t most_triangles;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> list{
      {"car", {4.31, 1.77, 1.47}, {"", "hatchback", "sedan", "estate", "suv"}, 2500},
      {"toy", {0.3, 0.123, 0.107}, {"", "sedan"}, 2500},
      {"van", {5.2, 1.96, 2.3}, {"", "panel van", "minibus", "box van"}, 2500},
      {"person", {0.53, 0.57, 1.71}, {"", "standing", "walking"}, 1500},
      {"bicycle", {1.77, 0.61, 1.07}, {"", "city", "racing"}, 2000},
      {"chair", {0.52, 0.5, 0.91}, {"", "wooden", "kitchen", "office", "armchair"}, 1000},
      {"dining table", {0.9, 1.5, 0.74}, {"", "rectangular", "round", "trestle"}, 1000},
      {"monitor", {0.19, 0.57, 0.43}, {"", "desk", "television"}, 500},
      {"couch", {0.93, 1.9, 0.83}, {"", "two seats", "three seats"}, 1500}};
  return list;
}

sim::SceneObject objectOf(const Kind& kind, const std::string& shape, std::uint64_t seed) {
  sim::SceneObject object;
  object.class_name = kind.class_name;
  object.shape = shape;
  object.look_seed = seed;
  object.size = kind.size;
  return object;
}

struct Scenery {
  sim::PropKind kind;
  std::string name;
  Vector3d size;
};

const std::vector<Scenery>& scenery() {
  using sim::PropKind;
  static const std::vector<Scenery> list{{PropKind::kFacade, "facade", {12.3, 7.0, 9.1}},
                                         {PropKind::kTree, "tree", {2.9, 2.7, 7.3}},
                                         {PropKind::kPole, "post", {0.16, 0.16, 5.3}},
                                         {PropKind::kPole, "lamp", {1.6, 0.3, 6.1}},
                                         {PropKind::kPole, "sign", {0.14, 0.52, 2.6}},
                                         {PropKind::kPole, "bollard", {0.2, 0.2, 0.9}},
                                         {PropKind::kHedge, "hedge", {3.7, 0.6, 1.2}},
                                         {PropKind::kWall, "wall", {5.1, 0.2, 1.6}},
                                         {PropKind::kWall, "room's wall", {0.15, 8, 2.6}},
                                         {PropKind::kKerb, "kerb", {6.3, 0.15, 0.12}},
                                         {PropKind::kFloor, "floor", {4.0, 3.0, 0.02}},
                                         {PropKind::kCrate, "crate", {0.8, 0.6, 0.55}},
                                         {PropKind::kShelf, "shelf", {1.2, 0.33, 1.9}}};
  return list;
}

sim::Prop propOf(const Scenery& thing, std::uint64_t seed) {
  sim::Prop prop;
  prop.kind = thing.kind;
  prop.look_seed = seed;
  prop.size = thing.size;
  return prop;
}

constexpr std::array<std::uint64_t, 4> kSeeds{1, 7, 23, 0x0200000000000011ULL};

/// Makes every class, every shape and all scenery, with several appearances.
std::vector<Sample> makeAll() {
  std::vector<Sample> all;
  for (const std::uint64_t seed : kSeeds) {
    const std::string look = ", look " + std::to_string(seed);
    for (const Kind& kind : kinds()) {
      for (const std::string& shape : kind.shapes) {
        all.push_back({kind.class_name + " " + shape + look, kind.size,
                       makeObjectMesh(objectOf(kind, shape, seed))});
      }
    }
    for (const Scenery& thing : scenery()) {
      all.push_back({thing.name + look, thing.size, makePropMesh(propOf(thing, seed))});
    }
  }
  return all;
}

void forAll(const std::function<void(const Sample&)>& see) {
  static const std::vector<Sample> all = makeAll();
  for (const Sample& sample : all) see(sample);
}

Vector3f acrossOf(const Mesh& mesh, std::size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vector3f a = mesh.positions[t[0]];
  return (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
}

bool sameBytes(const Mesh& a, const Mesh& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  if (a.materials.size() != b.materials.size()) return false;
  for (std::size_t i = 0; i < a.materials.size(); ++i) {
    const Material &m = a.materials[i], &n = b.materials[i];
    if (m.colour != n.colour || m.gloss != n.gloss || m.emission != n.emission ||
        m.texture != n.texture) {
      return false;
    }
  }
  return same(a.positions, b.positions) && same(a.normals, b.normals) && same(a.uvs, b.uvs) &&
         same(a.triangles, b.triangles) && same(a.material_of, b.material_of);
}

/// Returns the index of each vertex's position; equal positions have equal indices.
std::vector<std::size_t> placesOf(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::size_t> known;
  std::vector<std::size_t> places;
  for (const Vector3f& p : mesh.positions) {
    places.push_back(known.try_emplace({p.x(), p.y(), p.z()}, known.size()).first->second);
  }
  return places;
}

struct Part {
  double volume = 0.0;
  bool closed = true;
};

/// Returns the connected parts of the mesh. A part is closed if every edge occurs once in each
/// direction.
std::vector<Part> partsOf(const Mesh& mesh) {
  const std::vector<std::size_t> places = placesOf(mesh);
  std::vector<std::size_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 1; k < 3; ++k) parent[root(places[t[k]])] = root(places[t[0]]);
  }
  std::map<std::size_t, Part> parts;
  std::map<std::pair<std::size_t, std::size_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>();
    parts[root(places[t[0]])].volume += a.cross(b).dot(mesh.positions[t[2]].cast<double>()) / 6.0;
    for (std::size_t k = 0; k < 3; ++k) ++edges[{places[t[k]], places[t[(k + 1) % 3]]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (count != 1 || back == edges.end() || back->second != 1) {
      parts[root(edge.first)].closed = false;
    }
  }
  std::vector<Part> list;
  for (const auto& [first, part] : parts) list.push_back(part);
  return list;
}

TEST(Shapes, FillTheirSizeExactly) {
  forAll([](const Sample& s) {
    Eigen::AlignedBox3f box;
    for (const Vector3f& p : s.mesh.positions) box.extend(p);
    const Vector3f half = (s.size / 2.0).cast<float>();
    EXPECT_EQ(box.max(), half) << s.name;
    EXPECT_EQ(box.min(), -half) << s.name;
  });
}

TEST(Shapes, HaveIndicesMaterialsAndCoordinatesThatExist) {
  forAll([](const Sample& s) {
    const Mesh& m = s.mesh;
    ASSERT_GT(m.triangles.size(), 0U) << s.name;
    ASSERT_EQ(m.normals.size(), m.positions.size()) << s.name;
    ASSERT_EQ(m.uvs.size(), m.positions.size()) << s.name;
    ASSERT_EQ(m.material_of.size(), m.triangles.size()) << s.name;
    for (const auto& t : m.triangles) {
      for (const std::uint32_t i : t) ASSERT_LT(i, m.positions.size()) << s.name;
    }
    for (const std::uint16_t i : m.material_of) ASSERT_LT(i, m.materials.size()) << s.name;
    for (const Vector2f& uv : m.uvs) ASSERT_TRUE(uv.allFinite()) << s.name;
    for (const Material& material : m.materials) {
      EXPECT_GE(material.colour.minCoeff(), 0.0F) << s.name;
      EXPECT_LE(material.gloss, 1.0F) << s.name;
    }
  });
}

TEST(Shapes, HaveUnitNormalsOnTheOuterSideOfEachTriangle) {
  forAll([](const Sample& s) {
    for (const Vector3f& n : s.mesh.normals) ASSERT_NEAR(n.norm(), 1.0F, 1e-4F) << s.name;
    for (std::size_t i = 0; i < s.mesh.triangles.size(); ++i) {
      const Vector3f across = acrossOf(s.mesh, i);
      for (const std::uint32_t corner : s.mesh.triangles[i]) {
        ASSERT_GT(across.dot(s.mesh.normals[corner]), 0.0F) << s.name << ", triangle " << i;
      }
    }
  });
}

TEST(Shapes, HaveClosedPartsWithTheOutsideOutside) {
  std::map<std::string, int> closed_of;
  forAll([&](const Sample& s) {
    for (const Part& part : partsOf(s.mesh)) {
      if (!part.closed) continue;
      EXPECT_GT(part.volume, 0.0) << s.name;
      ++closed_of[s.name.substr(0, s.name.find_first_of(" ,"))];
    }
  });
  for (const std::string name : {"car", "van", "person", "bicycle", "chair", "dining", "monitor",
                                 "couch", "tree", "post", "floor"}) {
    EXPECT_GT(closed_of[name], 0) << name;
  }
}

struct Ray {
  Vector3f from, way;
};

/// Returns the distance along the ray to the triangle (Möller and Trumbore, 1997), if it
/// intersects.
std::optional<float> meets(const Mesh& mesh, std::size_t triangle, const Ray& ray) {
  const auto& t = mesh.triangles[triangle];
  const Vector3f a = mesh.positions[t[0]], u = mesh.positions[t[1]] - a,
                 v = mesh.positions[t[2]] - a, p = ray.way.cross(v), s = ray.from - a;
  const float det = u.dot(p);
  if (std::abs(det) < 1e-12F) return {};
  const float b = s.dot(p) / det, c = ray.way.dot(s.cross(u)) / det;
  if (b < 0.0F || c < 0.0F || b + c > 1.0F) return {};
  return v.dot(s.cross(u)) / det;
}

/// Returns whether the ray first meets the back of a one-sided face.
bool seesAnInside(const Mesh& mesh, const Ray& ray, float tolerance) {
  float nearest = 1e9F, nearest_front = 1e9F;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto distance = meets(mesh, i, ray);
    if (!distance) continue;
    nearest = std::min(nearest, *distance);
    const bool front = acrossOf(mesh, i).dot(ray.way) < 0.0F;
    if (front || mesh.materials[mesh.material_of[i]].two_sided) {
      nearest_front = std::min(nearest_front, *distance);
    }
  }
  return nearest_front > nearest + tolerance;
}

TEST(Shapes, ShowNobodyTheirInside) {
  std::mt19937_64 engine(5);
  const auto unit = [&] { return static_cast<float>(engine() >> 40U) * 0x1.0p-24F; };
  forAll([&](const Sample& s) {
    const Vector3f half = (s.size / 2.0).cast<float>();
    int seen = 0;
    for (int i = 0; i < 120; ++i) {
      const float angle = 6.2831853F * unit(), height = 0.6F * unit();
      const Vector3f out(std::cos(angle), std::sin(angle), height);
      const Vector3f target =
          half.cwiseProduct(Vector3f(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1));
      const Vector3f from = target + 4.0F * half.norm() * out;
      if (seesAnInside(s.mesh, {from, (target - from).normalized()}, 0.002F * half.norm())) ++seen;
    }
    EXPECT_EQ(seen, 0) << s.name;
  });
}

TEST(Shapes, StayWithinTheRenderersBudget) {
  for (const Kind& kind : kinds()) {
    for (const std::string& shape : kind.shapes) {
      for (const std::uint64_t seed : kSeeds) {
        EXPECT_LE(makeObjectMesh(objectOf(kind, shape, seed)).triangles.size(), kind.most_triangles)
            << kind.class_name << " " << shape;
      }
    }
  }
  for (const std::uint64_t seed : kSeeds) {
    EXPECT_LE(makePropMesh(propOf(scenery()[1], seed)).triangles.size(), 2200U);
  }
}

TEST(Shapes, OfTheSameSeedAreTheSameBytes) {
  const std::vector<Sample> again = makeAll();
  std::size_t i = 0;
  forAll([&](const Sample& s) { EXPECT_TRUE(sameBytes(again.at(i++).mesh, s.mesh)) << s.name; });
  EXPECT_EQ(i, again.size());
}

TEST(Shapes, OfDifferentLooksDiffer) {
  for (const Kind& kind : kinds()) {
    for (const std::string& shape : kind.shapes) {
      EXPECT_FALSE(sameBytes(makeObjectMesh(objectOf(kind, shape, 4)),
                             makeObjectMesh(objectOf(kind, shape, 5))))
          << kind.class_name << " " << shape;
    }
  }
}

TEST(Shapes, OfDifferentSetsOfLooksShareNoTexture) {
  const auto picturesOf = [](std::uint64_t set) {
    std::set<const Texture*> pictures;
    std::vector<Mesh> meshes;
    for (std::uint64_t i = 0; i < 20; ++i) {
      meshes.push_back(makeObjectMesh(objectOf(kinds()[0], "", (set << 56U) + i)));
      for (const Material& m : meshes.back().materials) pictures.insert(m.texture.get());
    }
    pictures.erase(nullptr);
    return std::pair(std::move(meshes), std::move(pictures));
  };
  const auto [train, of_train] = picturesOf(1);
  const auto [test, of_test] = picturesOf(2);
  ASSERT_GT(of_train.size(), 1U);
  for (const Texture* picture : of_test) EXPECT_EQ(of_train.count(picture), 0U);
}

TEST(Shapes, OfClassesAndShapesThatAreNotKnownAreRefused) {
  sim::SceneObject object = objectOf(kinds()[0], "", 1);
  object.class_name = "zeppelin";
  EXPECT_THROW(makeObjectMesh(object), std::invalid_argument);
  for (const Kind& kind : kinds()) {
    EXPECT_THROW(makeObjectMesh(objectOf(kind, "airship", 1)), std::invalid_argument)
        << kind.class_name;
  }
}

TEST(Ground, LiesUnderEveryRoadAndLooksUp) {
  sim::Scene scene;
  scene.seed = 5;
  scene.roads = {{{-40.0, 0.0}, {90.0, 10.0}, 7.0}, {{20.0, -60.0}, {20.0, 70.0}, 6.0}};
  const Mesh mesh = makeGroundMesh(scene);
  Eigen::AlignedBox2f box;
  for (const Vector3f& p : mesh.positions) {
    EXPECT_NEAR(p.z(), 0.0F, 0.011F);
    box.extend(Vector2f(p.head<2>()));
  }
  for (const Vector3f& n : mesh.normals) ASSERT_GT(n.z(), 0.999F);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    ASSERT_GT(acrossOf(mesh, i).z(), 0.0F) << "triangle " << i;
  }
  for (const sim::Road& road : scene.roads) {
    EXPECT_TRUE(box.contains(Vector2f(road.from.cast<float>())));
    EXPECT_TRUE(box.contains(Vector2f(road.to.cast<float>())));
  }
  EXPECT_TRUE(sameBytes(mesh, makeGroundMesh(scene)));
}

TEST(Ground, OfARoomReachesBeyondItsWalls) {
  sim::Scene scene;
  scene.ground = sim::GroundKind::kRoom;
  sim::Prop wall = propOf(scenery()[7], 3);
  wall.T_WP.p = Vector3d(4.0, -3.0, 0.8);
  scene.props = {wall};
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : makeGroundMesh(scene).positions) box.extend(p);
  EXPECT_EQ(box.min().z(), 0.0F);
  EXPECT_EQ(box.max().z(), 0.0F);
  EXPECT_GT(box.max().x(), 7.0F);
  EXPECT_LT(box.min().y(), -6.0F);
}

}  // namespace
}  // namespace perdure::tools

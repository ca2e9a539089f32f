// Writes the shapes of the classes for the page (BufferGeometryLoader of three.js).
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "tools/simulate/shapes/mesh.h"

namespace {

using namespace perdure;
using Json = nlohmann::ordered_json;

struct Shape {
  const char *file, *class_name;
  Eigen::Vector3d size;  ///< typical size in m, which gives the proportions of the parts
  std::uint64_t look;
};

float brightness(const tools::Material& material) {
  return 0.2126F * material.colour.x() + 0.7152F * material.colour.y() +
         0.0722F * material.colour.z();
}

/// Returns the brightness of each material, relative to the material with the largest area.
std::vector<float> shades(const tools::Mesh& mesh) {
  std::vector<float> area(mesh.materials.size(), 0.0F);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3f ab = mesh.positions[b] - mesh.positions[a];
    area[mesh.material_of[i]] += ab.cross(mesh.positions[c] - mesh.positions[a]).norm();
  }
  const auto body = std::max_element(area.begin(), area.end()) - area.begin();
  std::vector<float> result;
  for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
    constexpr float kBrightest = 0.75F, kDarkest = 0.12F;
    // Square root converts linear light to perceived brightness.
    const float shade = std::clamp(std::sqrt(brightness(mesh.materials[i])), kDarkest, kBrightest);
    result.push_back(static_cast<std::ptrdiff_t>(i) == body ? 1.0F : shade);
  }
  return result;
}

/// Rounds to five decimals, a tenth of a millimetre for a large object.
Json vectors(const std::vector<float>& values) {
  Json array = Json::array();
  for (const float value : values) array.push_back(std::round(1e5 * double{value}) / 1e5);
  return {{"itemSize", 3}, {"type", "Float32Array"}, {"array", std::move(array)}};
}

/// A mesh in a unit box about the origin. The colour is the brightness of each part, relative to
/// the largest one; the page multiplies it by the colour of the class.
Json geometryOf(const tools::Mesh& mesh) {
  Eigen::Vector3f low = mesh.positions.front(), high = low;
  for (const auto& p : mesh.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector3f middle = (low + high) / 2, size = high - low;
  const auto shade = shades(mesh);
  std::map<std::pair<std::uint32_t, std::uint16_t>, std::uint32_t> index;
  std::vector<float> positions, normals, colours;
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      const auto [at, is_new] = index.try_emplace({corner, mesh.material_of[i]}, index.size());
      indices.push_back(at->second);
      if (!is_new) continue;
      const Eigen::Vector3f p = (mesh.positions[corner] - middle).cwiseQuotient(size);
      // The page scales the mesh to the object's size. Normals need the inverse scale.
      const Eigen::Vector3f n = mesh.normals[corner].cwiseProduct(size).normalized();
      positions.insert(positions.end(), {p.x(), p.y(), p.z()});
      normals.insert(normals.end(), {n.x(), n.y(), n.z()});
      colours.insert(colours.end(), 3, shade[mesh.material_of[i]]);
    }
  }
  const Json attributes = {
      {"position", vectors(positions)}, {"normal", vectors(normals)}, {"color", vectors(colours)}};
  return {{"data",
           {{"attributes", attributes}, {"index", {{"type", "Uint32Array"}, {"array", indices}}}}}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 64;
  }
  const Shape shapes[] = {
      {"car", "car", {4.3, 1.75, 1.5}, 5},         {"van", "van", {5.1, 1.95, 2.2}, 3},
      {"person", "person", {0.5, 0.6, 1.75}, 2},   {"bicycle", "bicycle", {1.75, 0.55, 1.05}, 1},
      {"chair", "chair", {0.5, 0.5, 0.9}, 1},      {"table", "dining table", {1.6, 0.9, 0.75}, 1},
      {"monitor", "monitor", {0.2, 0.6, 0.45}, 1}, {"couch", "couch", {0.95, 2.0, 0.85}, 1}};
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  for (const Shape& shape : shapes) {
    sim::SceneObject object;
    object.class_name = shape.class_name;
    object.size = shape.size;
    object.look_seed = shape.look;
    std::ofstream file(folder / (std::string(shape.file) + ".json"));
    file << geometryOf(tools::makeObjectMesh(object));
    if (!file) {
      std::cerr << folder / shape.file << ".json cannot be written\n";
      return 69;
    }
  }
  return 0;
}

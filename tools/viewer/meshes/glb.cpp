#include "tools/viewer/meshes/glb.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

namespace perdure::tools::viewer {
namespace {

using Json = nlohmann::ordered_json;
enum Component { kUint32 = 5125, kFloat32 = 5126 };

struct Vertices {
  std::vector<float> positions, normals, colours;
  std::vector<std::uint32_t> indices;
};

float brightness(const Material& material) {
  return 0.2126F * material.colour.x() + 0.7152F * material.colour.y() +
         0.0722F * material.colour.z();
}

/// Shade of each material, relative to the one with the largest area.
std::vector<float> shades(const Mesh& mesh) {
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

Vertices verticesOf(const Mesh& mesh) {
  Eigen::Vector3f low = mesh.positions.front(), high = low;
  for (const auto& p : mesh.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector3f middle = (low + high) / 2, size = high - low;
  const auto shade = shades(mesh);
  std::map<std::pair<std::uint32_t, std::uint16_t>, std::uint32_t> index;
  Vertices out;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      const auto [at, is_new] = index.try_emplace({corner, mesh.material_of[i]}, index.size());
      out.indices.push_back(at->second);
      if (!is_new) continue;
      const Eigen::Vector3f p = (mesh.positions[corner] - middle).cwiseQuotient(size);
      // The page scales the mesh back; a normal needs the inverse scale.
      const Eigen::Vector3f n = mesh.normals[corner].cwiseProduct(size).normalized();
      out.positions.insert(out.positions.end(), {p.x(), p.y(), p.z()});
      out.normals.insert(out.normals.end(), {n.x(), n.y(), n.z()});
      out.colours.insert(out.colours.end(), 3, shade[mesh.material_of[i]]);
    }
  }
  return out;
}

template <class T>
void append(std::string& binary, const std::vector<T>& values, Json& json, Component component,
            const char* type, std::size_t count) {
  const std::size_t bytes = values.size() * sizeof(T);
  json["accessors"].push_back({{"bufferView", json["accessors"].size()},
                               {"componentType", static_cast<int>(component)},
                               {"count", count},
                               {"type", type}});
  json["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes}});
  binary.append(reinterpret_cast<const char*>(values.data()), bytes);
}

void putNatural(std::string& out, std::size_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out += static_cast<char>((value >> shift) & 0xffU);
  }
}

}  // namespace

std::string glbOf(const Mesh& mesh) {
  const Vertices v = verticesOf(mesh);
  const std::size_t n = v.positions.size() / 3;
  Json json = {{"asset", {{"version", "2.0"}, {"generator", "perdure"}}},
               {"scene", 0},
               {"scenes", {{{"nodes", {0}}}}},
               {"nodes", {{{"mesh", 0}}}},
               {"accessors", Json::array()},
               {"bufferViews", Json::array()}};
  std::string binary;
  append(binary, v.positions, json, kFloat32, "VEC3", n);
  json["accessors"][0]["min"] = {-0.5, -0.5, -0.5};
  json["accessors"][0]["max"] = {0.5, 0.5, 0.5};
  append(binary, v.normals, json, kFloat32, "VEC3", n);
  append(binary, v.colours, json, kFloat32, "VEC3", n);
  append(binary, v.indices, json, kUint32, "SCALAR", v.indices.size());
  json["meshes"] = {
      {{"primitives",
        {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}}, {"indices", 3}}}}}};
  json["buffers"] = {{{"byteLength", binary.size()}}};
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  constexpr std::size_t kHead = 12, kChunkHead = 8;
  std::string glb = "glTF";
  putNatural(glb, 2);
  putNatural(glb, kHead + 2 * kChunkHead + text.size() + binary.size());
  putNatural(glb, text.size());
  glb += "JSON" + text;
  putNatural(glb, binary.size());
  glb += std::string("BIN\0", 4) + binary;
  return glb;
}

}  // namespace perdure::tools::viewer

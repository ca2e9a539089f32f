// Writes the shapes of the classes for the page: FOLDER/car.glb, …; run once by the build.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tools/viewer/meshes/glb.h"

namespace {

struct Shape {
  const char *file, *class_name;
  Eigen::Vector3d size;  ///< m, a typical size, for the proportions of the parts
  std::uint64_t look;
};

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
    perdure::sim::SceneObject object;
    object.class_name = shape.class_name;
    object.size = shape.size;
    object.look_seed = shape.look;
    std::ofstream file(folder / (std::string(shape.file) + ".glb"), std::ios::binary);
    file << perdure::tools::viewer::glbOf(perdure::tools::makeObjectMesh(object));
    if (!file) {
      std::cerr << folder / shape.file << ".glb cannot be written\n";
      return 69;
    }
  }
  return 0;
}

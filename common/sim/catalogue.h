// The catalogue of classes: their shapes and the ranges of their sizes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

/// A shape of a class with the range of its sizes in metres: length (x, forwards), width, height.
/// If the name is empty, the look's seed determines the shape.
struct Shape {
  std::string name;
  Eigen::Vector3d smallest, largest;
  double share = 1.0;  ///< frequency relative to the class's other shapes
};

/// The eight classes of the truth, in the order of the project's network.
const std::vector<std::string>& truthClasses();
const std::vector<Shape>& shapesOf(const std::string& class_name);

/// Draws an object of the class, with shape, size and look, but without id and pose.
SceneObject drawObject(const std::string& class_name, Dice& dice, const std::string& look_set);

/// Draws the seed of a look. Its top byte is the number of the set, so that sets have no common
/// seeds.
std::uint64_t lookSeed(Dice& dice, const std::string& look_set);

}  // namespace perdure::sim

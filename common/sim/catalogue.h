// What things of each class are like: the shapes there are and how large they get.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

/// A shape of a class and the range of its sizes: length (x, forwards), width, height; metres.
/// An empty name leaves the shape to the look's seed.
struct Shape {
  std::string name;
  Eigen::Vector3d smallest, largest;
  double share = 1.0;  ///< how often, relative to the class's other shapes
};

/// The eight classes that the truth knows, in the order of the project's network.
const std::vector<std::string>& truthClasses();
const std::vector<Shape>& shapesOf(const std::string& class_name);

/// A new thing of the class: class, shape, size and look are set; id and place are not.
SceneObject drawObject(const std::string& class_name, Dice& dice, const std::string& look_set);

/// The seed of a look. Its top byte is the set's number, so that sets share none.
std::uint64_t lookSeed(Dice& dice, const std::string& look_set);

}  // namespace perdure::sim

// The generators of object classes and scenery, which mesh.h calls.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

/// Arguments of a generator: exact size, name of the shape (if empty, the look's seed chooses one)
/// and seed of the look. Each generator throws std::invalid_argument for an unknown shape.
struct Order {
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  std::string shape;
  std::uint64_t look_seed = 0;
};

Mesh makeCar(const Order& order);
Mesh makeVan(const Order& order);
Mesh makePerson(const Order& order);
Mesh makeBicycle(const Order& order);
Mesh makeChair(const Order& order);
Mesh makeTable(const Order& order);
Mesh makeMonitor(const Order& order);
Mesh makeCouch(const Order& order);

Mesh makeFacade(const Order& order);
Mesh makeTree(const Order& order);
Mesh makeHedge(const Order& order);
Mesh makePole(const Order& order);
Mesh makeWall(const Order& order);
Mesh makeKerb(const Order& order);
Mesh makeFloor(const Order& order);
Mesh makeCrate(const Order& order);
Mesh makeShelf(const Order& order);

/// Returns the order's shape or, if it is empty, one of `known` chosen by the look. Throws
/// std::invalid_argument for a shape that is not in `known`.
std::string chosenShape(const Order& order, const std::string& class_name,
                        const std::vector<std::string>& known);

}  // namespace perdure::tools::shapes

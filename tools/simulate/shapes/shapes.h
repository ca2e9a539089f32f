// The generators of object classes and scenery, behind `mesh.h`.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

/// Arguments of a generator: the exact size, the name of the shape (empty: chosen by the look) and
/// the seed of the look. Each generator throws std::invalid_argument for an unknown shape.
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

/// The shape of the order, or one chosen by the look if it is empty; it must be one of `known`.
std::string chosenShape(const Order& order, const std::string& class_name,
                        const std::vector<std::string>& known);

}  // namespace perdure::tools::shapes

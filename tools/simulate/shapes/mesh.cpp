#include "tools/simulate/shapes/mesh.h"

#include <array>
#include <stdexcept>
#include <string>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools {

Mesh makeObjectMesh(const sim::SceneObject& object) {
  const shapes::Order order{object.size, object.shape, object.look_seed};
  const std::string& name = object.class_name;
  if (name == "car" || name == "toy") return shapes::makeCar(order);
  if (name == "van") return shapes::makeVan(order);
  if (name == "person") return shapes::makePerson(order);
  if (name == "bicycle") return shapes::makeBicycle(order);
  if (name == "chair") return shapes::makeChair(order);
  if (name == "dining table") return shapes::makeTable(order);
  if (name == "monitor") return shapes::makeMonitor(order);
  if (name == "couch") return shapes::makeCouch(order);
  throw std::invalid_argument("no shape is known for objects of class '" + name + "'");
}

Mesh makePropMesh(const sim::Prop& prop) {
  using namespace shapes;
  // In the order of PropKind.
  constexpr std::array kGenerators{makeFacade, makeTree,  makePole,  makeHedge, makeWall,
                                   makeKerb,   makeFloor, makeCrate, makeShelf};
  return kGenerators.at(static_cast<std::size_t>(prop.kind))({prop.size, "", prop.look_seed});
}

namespace shapes {

std::string chosenShape(const Order& order, const std::string& class_name,
                        const std::vector<std::string>& known) {
  if (order.shape.empty()) return known[mixBits(order.look_seed) % known.size()];
  std::string list;
  for (const std::string& name : known) {
    if (name == order.shape) return name;
    list += (list.empty() ? "" : ", ") + name;
  }
  throw std::invalid_argument("a " + class_name + " has no shape '" + order.shape +
                              "'; known: " + list);
}

}  // namespace shapes
}  // namespace perdure::tools

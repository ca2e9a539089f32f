#include "tools/simulate/shapes/mesh.h"

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
  const shapes::Order order{prop.size, "", prop.look_seed};
  switch (prop.kind) {
    case sim::PropKind::kFacade:
      return shapes::makeFacade(order);
    case sim::PropKind::kTree:
      return shapes::makeTree(order);
    case sim::PropKind::kPole:
      return shapes::makePole(order);
    case sim::PropKind::kHedge:
      return shapes::makeHedge(order);
    case sim::PropKind::kWall:
      return shapes::makeWall(order);
    case sim::PropKind::kKerb:
      return shapes::makeKerb(order);
    case sim::PropKind::kFloor:
      return shapes::makeFloor(order);
    case sim::PropKind::kCrate:
      return shapes::makeCrate(order);
    case sim::PropKind::kShelf:
      return shapes::makeShelf(order);
  }
  throw std::invalid_argument("no shape is known for this kind of scenery");
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

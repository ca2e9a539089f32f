// A block of houses and the objects around it, drawn once and placed many times.
#pragma once

#include <vector>

#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

/// Places are relative to the centre of the block. Its four kerbs are at ± `half`; vehicles stand
/// on the road beside them.
class Block {
 public:
  /// Draws houses, trees, poles, parked vehicles, bicycles and a person.
  Block(const Eigen::Vector2d& half, SceneBuilder& builder);

  /// Removes or adds this number of objects (cars, bicycles or persons).
  void alter(std::size_t changes, SceneBuilder& builder);
  void putAt(const Eigen::Vector2d& middle, SceneBuilder& builder) const;

 private:
  struct Thing {
    SceneObject object;
    Place place;
  };
  struct Scenery {
    PropKind kind = PropKind::kFacade;
    Eigen::Vector3d size;
    Place place;
  };
  /// One of its four sides.
  struct Side;

  static std::vector<Side> sidesOf(const Eigen::Vector2d& half);
  void build(const Side& side, double length, Dice& dice);
  void plant(const Side& side, Dice& dice);
  void park(const Side& side, SceneBuilder& builder);
  bool fits(const Solid& solid, double margin) const;
  bool add(SceneObject object, const Place& place, double margin);
  bool add(PropKind kind, const Eigen::Vector3d& size, const Place& place);
  bool addSomewhere(const std::string& class_name, SceneBuilder& builder);

  Eigen::Vector2d half_;
  std::vector<Thing> things_;
  std::vector<Scenery> scenery_;
};

}  // namespace perdure::sim

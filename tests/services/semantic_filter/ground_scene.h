// A street of cars on the ground, and the priors of classes on the ground.
#pragma once

#include <vector>

#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter::testing {

inline const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

inline ClassPriors standing() {
  ClassPriors priors = makePriors();
  for (auto& c : priors.classes) c.stands = 0.97;
  return priors;
}

/// A car with its underside at `height` (m), observed from several sides.
inline Track carAt(ObjectId id, double x, double y, double height) {
  Track car = makeObject(id, "car", makeState(x, y, height + 0.75, 0.0, 4.2, 1.75, 1.5), 0.01);
  car.hypotheses[0].ground_contact.variance = 0.02 * 0.02;
  return car;
}

/// A street on both sides of x, with undersides at `height(x, y)` (m).
template <class Height>
std::vector<Track> street(Height height, int things = 8) {
  std::vector<Track> cars;
  for (int i = 0; i < things; ++i) {
    const double x = 5.0 + 4.0 * i, y = i % 2 == 0 ? 4.0 : -5.0;
    cars.push_back(carAt(static_cast<ObjectId>(i + 1), x, y, height(x, y)));
  }
  return cars;
}

}  // namespace perdure::semantic_filter::testing

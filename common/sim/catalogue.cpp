#include "common/sim/catalogue.h"

#include <map>

#include "common/base/check.h"
#include "common/base/errors.h"

namespace perdure::sim {
namespace {

// Sizes of European vehicles and furniture (manufacturers' data sheets, rounded).
const std::map<std::string, std::vector<Shape>>& catalogue() {
  static const std::map<std::string, std::vector<Shape>> shapes{
      {"car",
       {{"hatchback", {3.7, 1.66, 1.42}, {4.3, 1.80, 1.56}, 2.0},
        {"sedan", {4.4, 1.74, 1.40}, {4.9, 1.86, 1.48}, 1.0},
        {"estate", {4.4, 1.74, 1.44}, {4.85, 1.84, 1.54}, 1.0},
        {"suv", {4.2, 1.80, 1.60}, {4.75, 1.92, 1.76}, 1.0}}},
      {"van",
       {{"panel van", {4.8, 1.90, 1.95}, {5.6, 2.02, 2.45}, 1.0},
        {"minibus", {4.6, 1.86, 1.88}, {5.3, 1.98, 2.1}, 1.0},
        {"box van", {5.0, 1.95, 2.1}, {5.8, 2.1, 2.6}, 0.5}}},
      {"person", {{"", {0.38, 0.48, 1.55}, {0.62, 0.64, 1.9}, 1.0}}},
      {"bicycle", {{"", {1.65, 0.5, 1.0}, {1.85, 0.65, 1.15}, 1.0}}},
      {"chair", {{"", {0.47, 0.45, 0.8}, {0.6, 0.58, 0.98}, 1.0}}},
      {"dining table", {{"", {0.75, 1.2, 0.72}, {1.0, 1.8, 0.77}, 1.0}}},
      {"monitor", {{"", {0.16, 0.48, 0.38}, {0.24, 0.68, 0.5}, 1.0}}},
      {"couch", {{"", {0.85, 1.5, 0.75}, {1.0, 2.2, 0.92}, 1.0}}},
      {"toy", {{"", {0.28, 0.115, 0.10}, {0.32, 0.13, 0.115}, 1.0}}},
  };
  return shapes;
}

const Shape& drawShape(const std::vector<Shape>& shapes, Dice& dice) {
  double total = 0.0;
  for (const Shape& shape : shapes) total += shape.share;
  double left = dice.uniform(0.0, total);
  for (const Shape& shape : shapes) {
    left -= shape.share;
    if (left < 0.0) return shape;
  }
  return shapes.back();
}

std::uint64_t numberOf(const std::string& look_set) {
  if (look_set == "use") return 0;
  if (look_set == "train") return 1;
  if (look_set == "test") return 2;
  throw StartupError(ExitCode::kUsage,
                     "the set of looks \"" + look_set + "\" is none of use, train, test; name one");
}

}  // namespace

const std::vector<std::string>& truthClasses() {
  static const std::vector<std::string> classes{"car",   "van",          "person",  "bicycle",
                                                "chair", "dining table", "monitor", "couch"};
  return classes;
}

const std::vector<Shape>& shapesOf(const std::string& class_name) {
  const auto found = catalogue().find(class_name);
  check(found != catalogue().end(), "the class of a scene's object is in the catalogue");
  return found->second;
}

SceneObject drawObject(const std::string& class_name, Dice& dice, const std::string& look_set) {
  const Shape& shape = drawShape(shapesOf(class_name), dice);
  SceneObject object;
  object.class_name = class_name;
  object.looks_like = class_name == "toy" ? "car" : class_name;
  object.shape = shape.name;
  // The sizes in all directions are correlated: one common number determines half of their spread.
  const double overall = dice.unit();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double s = 0.5 * (overall + dice.unit());
    object.size[i] = shape.smallest[i] + s * (shape.largest[i] - shape.smallest[i]);
  }
  object.look_seed = lookSeed(dice, look_set);
  return object;
}

std::uint64_t lookSeed(Dice& dice, const std::string& look_set) {
  return (dice.seed() >> 8U) | (numberOf(look_set) << 56U);
}

}  // namespace perdure::sim

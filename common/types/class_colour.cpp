#include "common/types/class_colour.h"

#include <array>
#include <map>

#include "common/base/ids.h"

namespace perdure {
namespace {

constexpr Colour rgb(int r, int g, int b) { return {r / 255.0, g / 255.0, b / 255.0, 1.0}; }

}  // namespace

Colour classColour(const std::string& class_name) {
  static const std::map<std::string, Colour> kKnown = {
      {"car", rgb(56, 142, 224)},     {"van", rgb(20, 180, 184)},
      {"truck", rgb(60, 110, 180)},   {"bus", rgb(110, 110, 220)},
      {"person", rgb(245, 140, 50)},  {"bicycle", rgb(80, 180, 90)},
      {"cyclist", rgb(80, 180, 90)},  {"motorcycle", rgb(175, 115, 65)},
      {"chair", rgb(150, 110, 225)},  {"dining table", rgb(185, 135, 85)},
      {"monitor", rgb(30, 170, 130)}, {"couch", rgb(225, 95, 85)},
      {"toy", rgb(225, 180, 40)},     {"other", rgb(150, 150, 150)}};
  static constexpr std::array<Colour, 6> kFurther = {rgb(150, 170, 60),  rgb(90, 150, 170),
                                                     rgb(205, 115, 105), rgb(120, 130, 190),
                                                     rgb(190, 160, 100), rgb(100, 170, 130)};
  const auto found = kKnown.find(class_name);
  return found != kKnown.end() ? found->second : kFurther[digest(class_name) % kFurther.size()];
}

}  // namespace perdure

// The colour of a class in live scenes.
#pragma once

#include <string>

namespace perdure {

/// A colour in linear components, 0 … 1.
struct Colour {
  double r = 0, g = 0, b = 0, a = 1;
  Colour withAlpha(double alpha) const { return {r, g, b, alpha}; }
};
/// Known classes have fixed colours. Other classes have a colour derived from their name.
Colour classColour(const std::string& class_name);

}  // namespace perdure

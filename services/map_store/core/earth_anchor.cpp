#include "services/map_store/core/earth_anchor.h"

#include <cmath>
#include <sstream>

namespace perdure::map_store {

bool isEarthAnchor(const std::vector<double>& numbers) {
  return numbers.size() == 4 && std::abs(numbers[0]) <= 90.0 && std::abs(numbers[1]) <= 180.0 &&
         std::abs(numbers[2]) <= 1e5 && std::abs(numbers[3]) <= 360.0;
}

std::vector<double> earthAnchorFrom(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  for (double number = 0.0; numbers.size() <= 4 && stream >> number;) numbers.push_back(number);
  return isEarthAnchor(numbers) ? numbers : std::vector<double>();
}

}  // namespace perdure::map_store

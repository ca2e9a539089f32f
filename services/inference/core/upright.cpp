#include "services/inference/core/upright.h"

#include <cmath>
#include <numbers>

namespace perdure::inference {

int uprightQuarters(const Eigen::Vector3d& up_C, int present) {
  constexpr double kQuarter = std::numbers::pi / 2;
  constexpr double kMargin = std::numbers::pi / 18;  // the turn changes at 45° plus this margin
  constexpr double kLeast = 0.5;                     // share of `up_C` in the image plane
  if (!(up_C.head<2>().norm() > kLeast)) return present;
  // Clockwise turn after which `up_C` points to the top, that is against y.
  const double turn = -std::atan2(up_C.x(), -up_C.y());
  const double lean = std::remainder(turn - present * kQuarter, 4 * kQuarter);
  if (std::abs(lean) <= kQuarter / 2 + kMargin) return present;
  return (static_cast<int>(std::lround(turn / kQuarter)) + 4) % 4;
}

}  // namespace perdure::inference

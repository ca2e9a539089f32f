#include "tools/calibrate/estimate/spline.h"

namespace perdure::calibrate {

RigidTransform Spline::poseAt(double t) const {
  const std::size_t k = segmentAt(t);
  const double u = withinOf(k, t);
  const auto q = [&](std::size_t i) { return controls[k + i].q.coeffs().data(); };
  const auto p = [&](std::size_t i) { return controls[k + i].p.data(); };
  using Q = Eigen::Map<const Eigen::Quaterniond>;
  using P = Eigen::Map<const Eigen::Vector3d>;
  const std::array<Q, kOrder> turns = {Q(q(0)), Q(q(1)), Q(q(2)), Q(q(3)), Q(q(4))};
  const std::array<P, kOrder> places = {P(p(0)), P(p(1)), P(p(2)), P(p(3)), P(p(4))};
  return {rotationAt<double>(turns, u, interval_s).q, positionAt<double>(places, u, interval_s, 0)};
}

}  // namespace perdure::calibrate

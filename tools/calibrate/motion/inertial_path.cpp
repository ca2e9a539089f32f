#include "tools/calibrate/motion/inertial_path.h"

#include <algorithm>

#include "common/math/so3.h"

namespace perdure::calibrate {

InertialPath::InertialPath(const std::vector<ImuSample>& samples, const Eigen::Vector3d& gyro_bias,
                           TimePoint from, TimePoint to) {
  auto next = std::ranges::upper_bound(samples, from, {}, &ImuSample::time);
  next = std::clamp(next, samples.begin() + 1, samples.end() - 1);
  Step step{toSeconds((next - 1)->time - from), {}, {}};
  step.start.q.setIdentity();
  step.start.position.setZero(), step.start.velocity.setZero(), step.start.by_bias.setZero();
  for (;; ++next) {
    step.start.rate = 0.5 * ((next - 1)->gyro + next->gyro) - gyro_bias;
    step.force = 0.5 * ((next - 1)->accel + next->accel);
    steps_.push_back(step);
    if (next->time >= to || next + 1 == samples.end()) break;
    step.start = moved(step, toSeconds(next->time - (next - 1)->time));
    step.from_s = toSeconds(next->time - from);
  }
}

InertialState InertialPath::moved(const Step& step, double dt) {
  InertialState state = step.start;
  const Eigen::Quaterniond half = step.start.q * expQuaternion(0.5 * dt * step.start.rate);
  const Eigen::Vector3d force = half * step.force;
  state.position += dt * step.start.velocity + 0.5 * dt * dt * force;
  state.velocity += dt * force;
  state.q = (step.start.q * expQuaternion(dt * step.start.rate)).normalized();
  const Eigen::Matrix3d turned = state.q.toRotationMatrix().transpose();
  state.by_bias = turned * step.start.q.toRotationMatrix() * step.start.by_bias +
                  dt * turned * half.toRotationMatrix();
  return state;
}

InertialState InertialPath::at(double seconds) const {
  const auto after = std::upper_bound(steps_.begin() + 1, steps_.end(), seconds,
                                      [](double t, const Step& step) { return t < step.from_s; });
  return moved(*(after - 1), seconds - (after - 1)->from_s);
}

}  // namespace perdure::calibrate

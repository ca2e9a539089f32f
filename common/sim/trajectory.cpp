#include "common/sim/trajectory.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/b_spline.h"
#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr int kPositionOrder = 6, kRotationOrder = 5;
constexpr auto kPositionWeights = blendingMatrix<kPositionOrder>();
constexpr auto kRotationWeights = cumulativeMatrix<kRotationOrder>();

/// The controls near one time. Indices outside the range give the first or the last control.
class Controls {
 public:
  Controls(const std::vector<RigidTransform>& all, std::int64_t first) : all_(all), first_(first) {}
  const RigidTransform& operator[](std::size_t i) const {
    const auto last = static_cast<std::int64_t>(all_.size()) - 1;
    const std::int64_t index = first_ + static_cast<std::int64_t>(i);
    return all_[static_cast<std::size_t>(std::clamp<std::int64_t>(index, 0, last))];
  }

 private:
  const std::vector<RigidTransform>& all_;
  std::int64_t first_;
};

void evaluatePosition(const Controls& controls, double s, double interval, MotionState& state) {
  // Sums offsets from one control, so that positions far from the origin lose no digits.
  const Eigen::Vector3d base = controls[2].p;
  state.T_WB.p = base;
  for (std::size_t i = 0; i < kPositionOrder; ++i) {
    const auto w = evaluatePolynomial(kPositionWeights[i], s);
    const Eigen::Vector3d offset = controls[i].p - base;
    state.T_WB.p += w[0] * offset;
    state.velocity_W += w[1] / interval * offset;
    state.acceleration_W += w[2] / (interval * interval) * offset;
  }
}

void evaluateRotation(const Controls& controls, double s, double interval, MotionState& state) {
  Eigen::Quaterniond q = controls[0].q;
  for (std::size_t i = 1; i < kRotationOrder; ++i) {
    const auto w = evaluatePolynomial(kRotationWeights[i], s);
    const Eigen::Vector3d d = logSo3(controls[i - 1].q.conjugate() * controls[i].q);
    const Eigen::Quaterniond step = expQuaternion(w[0] * d);
    const double rate = w[1] / interval;
    q = q * step;
    state.angular_velocity_B = step.conjugate() * state.angular_velocity_B + rate * d;
    state.angular_acceleration_B = step.conjugate() * state.angular_acceleration_B +
                                   w[2] / (interval * interval) * d +
                                   rate * state.angular_velocity_B.cross(d);
  }
  state.T_WB.q = q.normalized();
}

}  // namespace

Trajectory::Trajectory(double start_s, double interval_s, std::vector<RigidTransform> control_poses)
    : start_s_(start_s), interval_s_(interval_s), control_(std::move(control_poses)) {
  check(!control_.empty(), "a trajectory has at least one control pose");
  check(interval_s_ > 0.0 && std::isfinite(interval_s_) && std::isfinite(start_s_),
        "a trajectory's interval is positive and its start finite");
}

MotionState Trajectory::at(double t_s) const {
  check(std::isfinite(t_s), "a trajectory is asked for a finite time");
  MotionState state;
  if (control_.size() == 1) {
    state.T_WB = control_.front();
    return state;
  }
  const double u =
      std::clamp((t_s - start_s_) / interval_s_, -8.0, static_cast<double>(control_.size()) + 8.0);
  const double position_segment = std::floor(u), rotation_segment = std::floor(u + 0.5);
  // The rotation's knots are half-way between the controls, so that neither spline lags.
  evaluatePosition(Controls(control_, static_cast<std::int64_t>(position_segment) - 2),
                   u - position_segment, interval_s_, state);
  evaluateRotation(Controls(control_, static_cast<std::int64_t>(rotation_segment) - 2),
                   u + 0.5 - rotation_segment, interval_s_, state);
  return state;
}

}  // namespace perdure::sim

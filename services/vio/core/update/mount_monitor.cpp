#include "services/vio/core/update/mount_monitor.h"

#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

constexpr std::chrono::seconds kCompared{30};  // longest time between two compared rotations
constexpr double kProbability = 0.999;
constexpr double kLeastTurn = 0.005;  // rad, smaller turns are corrected but not reported

}  // namespace

MountPose MountPose::of(const State& state) {
  const int at = state.camera(0).at;
  return {state.T_BC[0].q, state.P().block<3, 3>(at, at)};
}

void MountMonitor::compareWith(const MountPose& before, TimePoint now) {
  before_ = before;
  since_ = now;
}

bool MountMonitor::judge(const MountPose& now, TimePoint time) {
  bool found = false;
  if (before_) {
    const Eigen::Vector3d turned = logSo3(before_->q_BC.conjugate() * now.q_BC);
    found = turned.norm() > kLeastTurn &&
            squaredMahalanobis(turned, before_->covariance + now.covariance) >
                chi2Quantile(kProbability, 3);
    if (found) turn_ = turned.norm();
  }
  if (!before_ || found || time > since_ + kCompared) compareWith(now, time);
  return found;
}

}  // namespace perdure::vio

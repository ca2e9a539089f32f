#include "services/vio/core/update/mount_monitor.h"

#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

constexpr std::chrono::seconds kJudged{30};  // time after a jump in which a turn is found
constexpr double kProbability = 0.999;
constexpr double kLeastTurn = 0.005;  // rad, smaller turns are corrected but not reported

}  // namespace

MountPose MountPose::of(const State& state) {
  const int at = state.camera(0).at;
  return {state.T_BC[0].q, state.P().block<3, 3>(at, at)};
}

void MountMonitor::begin(const MountPose& before, TimePoint now) {
  if (before_) return;
  before_ = before;
  since_ = now;
}

bool MountMonitor::judge(const MountPose& now, TimePoint time) {
  if (!before_) return false;
  const Eigen::Vector3d turned = logSo3(before_->q_BC.conjugate() * now.q_BC);
  const double chi2 = squaredMahalanobis(turned, before_->covariance + now.covariance);
  const bool found = turned.norm() > kLeastTurn && chi2 > chi2Quantile(kProbability, 3);
  if (found) turn_ = turned.norm();
  if (found || time > since_ + kJudged) before_.reset();
  return found;
}

}  // namespace perdure::vio

// Initialisation of the state, from a start or from a saved state.
#include "common/base/check.h"
#include "common/math/so3.h"
#include "services/vio/core/estimator.h"

namespace perdure::vio {

void Estimator::start(const Start& start) {
  state_.emplace(T_BC_, time_offset_s_, static_cast<int>(options_.window.clones),
                 static_cast<int>(options_.window.slam_features), readout_s_,
                 options_.calibration.estimate_readout, options_.calibration.gyro_scale > 0.0);
  state_->nav = state_->nav_linear = start.nav;
  state_->time = start.time;
  auto P = state_->P();
  P.topLeftCorner<15, 15>() = start.covariance;
  const CalibrationOptions& c = options_.calibration;
  if (c.estimate_extrinsics) {
    double factor = 1.0;
    for (int i = 0; i < static_cast<int>(T_BC_.size()); ++i) {
      const double r = c.extrinsic_rotation * factor, p = c.extrinsic_position_m * factor;
      const int at = state_->extrinsicsAt(i);
      P.diagonal().segment<3>(at).setConstant(r * r);
      P.diagonal().segment<3>(at + 3).setConstant(p * p);
      factor = c.second_camera_factor;
    }
    // The second camera's pose has the error of the first one's, and a small error of its own.
    if (T_BC_.size() == 2) {
      const int a = state_->extrinsicsAt(0), b = state_->extrinsicsAt(1);
      const RigidTransform T_01 = T_BC_[0].inverse() * T_BC_[1];
      Matrix6d J = Matrix6d::Zero();  // T_BC1 = T_BC0 · T_01
      J.topLeftCorner<3, 3>() = T_01.R().transpose();
      J.bottomLeftCorner<3, 3>() = -T_BC_[0].R() * skew(T_01.p);
      J.bottomRightCorner<3, 3>().setIdentity();
      const Matrix6d P_a = P.block<6, 6>(a, a);
      P.block<6, 6>(b, a) = J * P_a;
      P.block<6, 6>(a, b) = (J * P_a).transpose();
      P.block<6, 6>(b, b) += J * P_a * J.transpose();
    }
  }
  if (c.estimate_time_offset) {
    P(state_->timeOffsetAt(), state_->timeOffsetAt()) = c.time_offset_s * c.time_offset_s;
  }
  for (std::size_t i = 0; i < T_BC_.size(); ++i) {
    if (const auto at = state_->readoutAt(i)) P(*at, *at) = c.readout_s * c.readout_s;
  }
  if (const auto at = state_->scaleAt()) {
    P.diagonal().segment<kScaleSize>(*at).setConstant(c.gyro_scale * c.gyro_scale);
  }
  database_.clear();
  previous_frame_.reset();
  agreed_ = false;
  supposed_m_ = 0.0;
  standstill_.forget();
  if (start.at_rest) standstill_.confirm(start.time, restExpectation(*state_, options_.gravity));
}

Result<void> Estimator::fits(const SavedState& saved) const {
  if (saved.T_BC.size() != T_BC_.size() || saved.readout_s.size() != T_BC_.size()) {
    return fail("state_other_cameras", "the saved state has another number of cameras");
  }
  Eigen::Index size = kNavSize + 6 * static_cast<Eigen::Index>(T_BC_.size()) + 1;
  for (std::size_t i = 0; i < T_BC_.size(); ++i) {
    const bool rolls = readout_s_[i] != 0.0;
    if (rolls != (saved.readout_s[i] != 0.0)) {
      return fail("state_other_shutter", "only one of the two has readout_s of a camera");
    }
    size += rolls && options_.calibration.estimate_readout;
  }
  const bool scale = options_.calibration.gyro_scale > 0.0;
  if (scale) size += kScaleSize;
  const Eigen::Index more = saved.covariance.rows() - size;
  if (more == 0) return {};
  if (more == (scale ? -kScaleSize : kScaleSize)) {
    return fail("state_other_gyro_scale",
                "calibration.gyro_scale is 0 now and was not when the state was saved, or was 0");
  }
  return fail("state_other_readout", "another number of read-outs is estimated");
}

void Estimator::restore(const SavedState& saved) {
  check(fits(saved).has_value(), "the cameras that were saved");
  start({saved.time, saved.nav, saved.covariance.topLeftCorner<15, 15>()});
  state_->T_BC = saved.T_BC;
  state_->time_offset_s = saved.time_offset_s;
  state_->readout_s = saved.readout_s;
  state_->gyro_scale = saved.gyro_scale;
  state_->P() = saved.covariance;
}

SavedState Estimator::save() const {
  check(started(), "there is a state");
  SavedState s;
  s.time = state_->time;
  s.nav = state_->nav;
  s.T_BC = state_->T_BC;
  s.time_offset_s = state_->time_offset_s;
  s.readout_s = state_->readout_s;
  s.gyro_scale = state_->gyro_scale;
  const int n = state_->calibrationEnd();
  s.covariance = state_->P().topLeftCorner(n, n);
  return s;
}

}  // namespace perdure::vio

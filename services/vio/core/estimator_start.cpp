// Initialisation of the state, from a start or from a saved state; its cameras.
#include "common/base/check.h"
#include "services/vio/core/estimator.h"

namespace perdure::vio {

void Estimator::start(const Start& start) {
  state_.emplace(T_BC_, time_offset_s_, static_cast<int>(options_.window.clones),
                 static_cast<int>(options_.window.slam_features), readout_s_,
                 options_.calibration.estimated());
  state_->nav = state_->nav_linear = start.nav;
  state_->time = start.time;
  auto P = state_->P();
  P.topLeftCorner<15, 15>() = start.covariance;
  const CalibrationOptions& c = options_.calibration;
  if (c.estimate_extrinsics) {
    // The second camera's pose has the error of the first one's, and a small error of its own.
    if (T_BC_.size() == 2) {
      const double r = c.extrinsic_rotation * c.second_camera_factor;
      const double p = c.extrinsic_position_m * c.second_camera_factor;
      const int at = state_->camera(1).at;
      P.diagonal().segment<3>(at).setConstant(r * r);
      P.diagonal().segment<3>(at + 3).setConstant(p * p);
    }
    state_->widenMount(c.extrinsic_rotation, c.extrinsic_position_m);
  }
  if (c.estimate_time_offset) {
    P(state_->timeOffsetAt(), state_->timeOffsetAt()) = c.time_offset_s * c.time_offset_s;
  }
  for (std::size_t i = 0; i < T_BC_.size(); ++i) {
    if (const auto at = state_->readoutAt(i)) P(*at, *at) = c.readout_s * c.readout_s;
    if (const auto at = state_->lensAt(i)) {
      P.diagonal().segment<kLensSize>(*at) = c.lensSigma().cwiseAbs2();
    }
  }
  if (const auto at = state_->scaleAt()) {
    P.diagonal().segment<kScaleSize>(*at).setConstant(c.gyro_scale * c.gyro_scale);
  }
  database_.clear();
  previous_frame_.reset();
  agreed_ = false;
  supposed_m_ = 0.0;
  standstill_.forget();
  mount_.forget();
  if (start.at_rest) standstill_.confirm(start.time, restExpectation(*state_, options_.gravity));
}

Result<void> Estimator::fits(const SavedState& saved) const {
  if (saved.T_BC.size() != T_BC_.size() || saved.readout_s.size() != T_BC_.size()) {
    return fail("state_other_cameras", "the saved state has another number of cameras");
  }
  for (std::size_t i = 0; i < T_BC_.size(); ++i) {
    if ((readout_s_[i] != 0.0) != (saved.readout_s[i] != 0.0)) {
      return fail("state_other_shutter", "only one of the two has readout_s of a camera");
    }
  }
  const Estimated estimated = options_.calibration.estimated();
  if (saved.estimated == estimated) return {};
  return fail("state_other_estimates",
              "when the state was saved, other keys of calibration.* were set, so that other "
              "quantities were estimated");
}

void Estimator::restore(const SavedState& saved) {
  check(fits(saved).has_value(), "the cameras that were saved");
  start({saved.time, saved.nav, saved.covariance.topLeftCorner<15, 15>()});
  state_->T_BC = saved.T_BC;
  state_->time_offset_s = saved.time_offset_s;
  state_->readout_s = saved.readout_s;
  state_->lens = saved.lens;
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
  s.lens = state_->lens;
  s.estimated = options_.calibration.estimated();
  s.gyro_scale = state_->gyro_scale;
  const int n = state_->calibrationEnd();
  s.covariance = state_->P().topLeftCorner(n, n);
  return s;
}

std::vector<CameraModel> Estimator::cameras(const std::vector<CameraModel>& calibrated) const {
  if (!state_) return calibrated;
  std::vector<CameraModel> result;
  for (std::size_t c = 0; c < calibrated.size(); ++c) {
    CameraCalibration camera = calibrated[c].calibration();
    camera.T_BC = state_->T_BC[c];
    camera.time_offset_s = state_->time_offset_s;
    camera.readout_s = state_->readout_s[c];
    result.push_back(withLens(CameraModel(camera), state_->lens[c]));
  }
  return result;
}

}  // namespace perdure::vio
